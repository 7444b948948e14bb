#include "estimator/batch_problem.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>

#include <ceres/solver.h>

#include "estimator/factors/imu_factor.h"
#include "estimator/factors/prior_factors.h"
#include "estimator/posterior.h"
#include "estimator/robust_loss.h"

namespace plumbline::estimator {
namespace {

// The search's: wide enough for honest noise, and past it an error of a hundred sigmas counts for little more than one
// of ten.
constexpr double kSearchLossScale = 3.0;
constexpr int kSearchIterations = 30;
// Relative. Ceres also stops at a step that makes things worse by less, and past a loss that grows as slowly as this
// one a bad step is a small share of the cost.
constexpr double kSearchTolerance = 1e-3;

}  // namespace

BatchProblem::BatchProblem(const BatchInput& input, const BatchValues& values, SolvePhase phase)
    : input_(input),
      phase_(phase),
      start_(values),
      extrinsics_(pack(values.calibration.T_B_C)),
      td_s_(values.calibration.td_s),
      readout_s_(values.calibration.readout_s),
      loss_(phase == SolvePhase::kSearch ? make_loss(RobustLoss::kCauchy, kSearchLossScale)
                                         : make_loss(input.config.loss, input.config.loss_scale)) {
  for (const core::State& state : values.states) states_.push_back(pack(state));

  ceres::Problem::Options options;
  options.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  options.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  problem_ = std::make_unique<ceres::Problem>(options);
  for (StateBlock& state : states_) problem_->AddParameterBlock(state.data(), kStateSize, &state_manifold_);
  problem_->AddParameterBlock(extrinsics_.data(), kPoseSize, &pose_manifold_);
  problem_->AddParameterBlock(&td_s_, 1);
  problem_->AddParameterBlock(&readout_s_, 1);
  if (!input_.config.estimate.extrinsics) problem_->SetParameterBlockConstant(extrinsics_.data());
  if (!input_.config.estimate.td) problem_->SetParameterBlockConstant(&td_s_);
  if (!input_.config.estimate.readout) problem_->SetParameterBlockConstant(&readout_s_);

  add_priors();
  inertial_begin_ = problem_->NumResidualBlocks();
  add_inertial_factors();
  visual_begin_ = problem_->NumResidualBlocks();
  const Timings timings = frame_timings();
  add_points(timings);
  add_lines(timings);
}

void BatchProblem::add_priors() {
  const core::InitialPrior& prior = input_.log.prior;
  const core::CalibrationSigmas& sigma = prior.calibration_sigma;
  problem_->AddResidualBlock(new StatePriorFactor(prior.mean, prior.sigma), nullptr, states_.front().data());
  if (input_.config.estimate.extrinsics) {
    problem_->AddResidualBlock(
        new ExtrinsicsPriorFactor(prior.calibration.T_B_C, sigma.extrinsic_position_m, sigma.extrinsic_rotation_rad),
        nullptr, extrinsics_.data());
  }
  if (input_.config.estimate.td) {
    problem_->AddResidualBlock(new ScalarPriorFactor(prior.calibration.td_s, sigma.td_s), nullptr, &td_s_);
  }
  if (input_.config.estimate.readout) {
    problem_->AddResidualBlock(new ScalarPriorFactor(prior.calibration.readout_s, sigma.readout_s), nullptr,
                               &readout_s_);
  }
}

void BatchProblem::add_inertial_factors() {
  const std::span<const core::ImuSample> imu(input_.log.imu);
  for (std::size_t i = 0; i + 1 < states_.size(); ++i) {
    const std::size_t first = start_.samples[i];
    const std::size_t last = start_.samples[i + 1];
    const Preintegration preintegration =
        preintegrate(imu.subspan(first, last - first + 1), start_.states[i].bias, input_.noise.imu);
    problem_->AddResidualBlock(new ImuFactor(preintegration, input_.log.gravity_m_s2), nullptr, states_[i].data(),
                               states_[i + 1].data());
  }
}

BatchProblem::Outcome BatchProblem::solve() {
  ceres::Solver::Options ceres_options;
  // Tracks of seconds leave few zeros between the states of a short recording, and dense Cholesky has less to keep
  // books of.
  constexpr std::size_t kDenseUpTo = 3000;
  const bool dense =
      input_.config.linear_solver == LinearSolver::kDenseSchur ||
      (input_.config.linear_solver == LinearSolver::kAutomatic && states_.size() * core::kStateDof <= kDenseUpTo);
  ceres_options.linear_solver_type = dense ? ceres::DENSE_SCHUR : ceres::SPARSE_SCHUR;
  ceres_options.dense_linear_algebra_library_type = ceres::LAPACK;
  ceres_options.sparse_linear_algebra_library_type = ceres::SUITE_SPARSE;
  auto landmarks = std::make_shared<ceres::ParameterBlockOrdering>();
  for (Eigen::Vector3d& landmark : landmarks_) landmarks->AddElementToGroup(landmark_block(landmark), 0);
  for (LineValue& line : lines_) landmarks->AddElementToGroup(line.block.data(), 0);
  auto ordering = std::make_shared<ceres::ParameterBlockOrdering>(*landmarks);
  for (StateBlock& state : states_) ordering->AddElementToGroup(state.data(), 1);
  for (double* block : {extrinsics_.data(), &td_s_, &readout_s_}) ordering->AddElementToGroup(block, 1);
  ceres_options.linear_solver_ordering = ordering;
  ceres_options.num_threads = 1;
  const bool search = phase_ == SolvePhase::kSearch;
  ceres_options.use_inner_iterations = landmarks->NumElements() > 0 && (search || !lines_.empty());
  ceres_options.inner_iteration_ordering = landmarks;
  ceres_options.max_num_iterations = search ? kSearchIterations : input_.config.max_iterations;
  ceres_options.max_solver_time_in_seconds = 1e9;  // never: a result must not depend on the machine's load
  ceres_options.function_tolerance = search ? kSearchTolerance : 1e-9;
  ceres_options.gradient_tolerance = 1e-14;
  ceres_options.parameter_tolerance = 1e-12;
  // Practically Gauss-Newton while it works (the start is close); Ceres damps by itself where a step fails.
  ceres_options.initial_trust_region_radius = 1e12;
  ceres_options.logging_type = ceres::SILENT;

  ceres::Solver::Summary ceres_summary;
  ceres::Solve(ceres_options, problem_.get(), &ceres_summary);

  Outcome outcome;
  switch (ceres_summary.termination_type) {
    case ceres::CONVERGENCE:
      outcome.status = core::SolveStatus::kConverged;
      break;
    case ceres::NO_CONVERGENCE:
      outcome.status = core::SolveStatus::kIterationLimit;
      break;
    default:
      outcome.status = core::SolveStatus::kDiverged;
  }
  outcome.summary = {.iterations = std::max(0, static_cast<int>(ceres_summary.iterations.size()) - 1),
                     .initial_cost = ceres_summary.initial_cost,
                     .final_cost = ceres_summary.final_cost,
                     .residuals = ceres_summary.num_residuals_reduced,
                     .parameters = ceres_summary.num_effective_parameters_reduced,
                     .landmarks = static_cast<int>(landmarks_.size() + lines_.size()),
                     .observations = observations_,
                     .visual = residual_sum(visual_begin_, problem_->NumResidualBlocks()),
                     .inertial = residual_sum(inertial_begin_, visual_begin_),
                     .prior = residual_sum(0, inertial_begin_)};
  return outcome;
}

core::ResidualSum BatchProblem::residual_sum(int first, int last) const {
  std::vector<ceres::ResidualBlockId> blocks;
  problem_->GetResidualBlocks(&blocks);
  ceres::Problem::EvaluateOptions options;
  options.apply_loss_function = false;
  options.num_threads = 1;
  options.residual_blocks = {blocks.begin() + first, blocks.begin() + last};
  if (options.residual_blocks.empty()) return {};  // Ceres would take them all
  double cost = 0.0;
  std::vector<double> residuals;
  if (!problem_->Evaluate(options, &cost, &residuals, nullptr, nullptr)) {
    cost = std::numeric_limits<double>::quiet_NaN();
  }
  return {.squares = 2.0 * cost, .residuals = static_cast<int>(residuals.size())};
}

BatchValues BatchProblem::values() const {
  BatchValues values = start_;
  values.calibration = {.T_B_C = unpack_pose(extrinsics_.data()), .td_s = td_s_, .readout_s = readout_s_};
  for (std::size_t i = 0; i < states_.size(); ++i) values.states[i] = unpack_state(states_[i].data());
  values.forget_landmarks();
  for (std::size_t i = 0; i < landmarks_.size(); ++i) values.landmarks[landmark_tracks_[i]] = landmarks_[i];
  for (std::size_t i = 0; i < lines_.size(); ++i) values.lines[line_tracks_[i]] = lines_[i];
  return values;
}

std::optional<core::PosteriorCovariance> BatchProblem::posterior_covariance() const {
  // Blocks that are held constant have no columns; `wanted` says which row of the answer each free column is.
  std::vector<double*> blocks;
  std::vector<int> wanted;
  const auto add = [&](const double* block, int size, int row) {
    blocks.push_back(const_cast<double*>(block));
    for (int i = 0; i < size; ++i) wanted.push_back(row + i);
  };
  if (input_.config.estimate.extrinsics) add(extrinsics_.data(), 6, core::kCovExtrinsicPosition);
  if (input_.config.estimate.td) add(&td_s_, 1, core::kCovTd);
  if (input_.config.estimate.readout) add(&readout_s_, 1, core::kCovReadout);
  add(states_.back().data(), core::kStateDof, core::kCovLastState);
  for (std::size_t i = 0; i + 1 < states_.size(); ++i) blocks.push_back(const_cast<double*>(states_[i].data()));
  for (const Eigen::Vector3d& landmark : landmarks_) {
    blocks.push_back(landmark_block(const_cast<Eigen::Vector3d&>(landmark)));
  }
  for (const LineValue& line : lines_) blocks.push_back(const_cast<double*>(line.block.data()));

  const auto covariance = leading_covariance(*problem_, blocks, static_cast<int>(wanted.size()));
  if (!covariance) return std::nullopt;
  core::PosteriorCovariance result = core::PosteriorCovariance::Zero();
  for (int r = 0; r < static_cast<int>(wanted.size()); ++r) {
    for (int c = 0; c < static_cast<int>(wanted.size()); ++c) {
      result(wanted[static_cast<std::size_t>(r)], wanted[static_cast<std::size_t>(c)]) = (*covariance)(r, c);
    }
  }
  return result;
}

}  // namespace plumbline::estimator
