#include "estimator/batch_problem.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <utility>

#include "estimator/factors/imu_factor.h"
#include "estimator/factors/prior_factors.h"
#include "estimator/posterior.h"
#include "estimator/robust_loss.h"
#include "estimator/schur_system.h"

namespace plumbline::estimator {
namespace {

// The search's: wide enough for honest noise, and past it an error of a hundred sigmas counts for little more than one
// of ten.
constexpr double kSearchLossScale = 3.0;
constexpr int kSearchIterations = 30;
// Of the cost.
constexpr double kSearchTolerance = 1e-3;
// In standard deviations, of all unknowns together.
constexpr double kStepTolerance = 1e-2;

}  // namespace

BatchProblem::BatchProblem(const BatchInput& input, const BatchValues& values, SolvePhase phase)
    : input_(input),
      phase_(phase),
      start_(values),
      spline_(values.spline),
      extrinsics_(pack(values.calibration.T_B_C)),
      td_s_(values.calibration.td_s),
      readout_s_(values.calibration.readout_s),
      loss_(phase == SolvePhase::kSearch ? make_loss(RobustLoss::kCauchy, kSearchLossScale)
                                         : make_loss(input.config.loss, input.config.loss_scale)) {
  if (spline_) {
    add_spline_blocks();
  } else {
    for (const core::State& state : values.states) states_.push_back(pack(state));
    for (StateBlock& state : states_) {
      add_block({.values = state.data(), .size = kStateSize, .dof = core::kStateDof, .manifold = &state_manifold_});
    }
  }
  const EstimateWhat& free = input_.config.estimate;
  extrinsics_block_ = add_block({.values = extrinsics_.data(),
                                 .size = kPoseSize,
                                 .dof = 6,
                                 .manifold = &pose_manifold_,
                                 .constant = !free.extrinsics});
  problem_.first_shared = extrinsics_block_;
  td_block_ = add_block({.values = &td_s_, .size = 1, .dof = 1, .constant = !free.td});
  readout_block_ = add_block({.values = &readout_s_, .size = 1, .dof = 1, .constant = !free.readout});

  const Timings timings = frame_timings();
  add_points(timings);
  line_begin_ = problem_.terms.size();
  first_line_block_ = static_cast<int>(problem_.blocks.size());
  add_lines(timings);
  inertial_begin_ = problem_.terms.size();
  if (spline_) {
    add_spline_inertial_factors();
  } else {
    add_inertial_factors();
  }
  prior_begin_ = problem_.terms.size();
  add_priors();
}

int BatchProblem::add_block(ParameterBlock block) {
  problem_.blocks.push_back(block);
  return static_cast<int>(problem_.blocks.size()) - 1;
}

void BatchProblem::add_term(Term term, const ceres::LossFunction* loss) {
  ResidualTerm& added = problem_.terms.emplace_back();
  added.factor = term.factor.get();
  added.count = static_cast<int>(term.blocks.size());
  added.loss = loss;
  std::copy(term.blocks.begin(), term.blocks.end(), added.blocks.begin());
  factors_.push_back(std::move(term.factor));
}

void BatchProblem::add_priors() {
  const core::InitialPrior& prior = input_.log.prior;
  const core::RigCalibration& mean = prior.calibration;
  const core::CalibrationSigmas& sigma = prior.calibration_sigma;
  const EstimateWhat& free = input_.config.estimate;
  if (spline_) {
    const SplineInstant at = spline_->at(input_.log, prior.t_ns);
    add_term({std::make_unique<SplineState>(spline_->knots, at, prior.mean, prior.sigma), blocks_at(at)}, nullptr);
  } else {
    add_term({std::make_unique<StatePriorFactor>(prior.mean, prior.sigma), {0}}, nullptr);
  }
  if (free.extrinsics) {
    add_term(
        {std::make_unique<ExtrinsicsPriorFactor>(mean.T_B_C, sigma.extrinsic_position_m, sigma.extrinsic_rotation_rad),
         {extrinsics_block_}},
        nullptr);
  }
  if (free.td) add_term({std::make_unique<ScalarPriorFactor>(mean.td_s, sigma.td_s), {td_block_}}, nullptr);
  if (free.readout) {
    add_term({std::make_unique<ScalarPriorFactor>(mean.readout_s, sigma.readout_s), {readout_block_}}, nullptr);
  }
}

void BatchProblem::add_inertial_factors() {
  const std::span<const core::ImuSample> imu(input_.log.imu);
  for (std::size_t i = 0; i + 1 < states_.size(); ++i) {
    const std::size_t first = start_.samples[i];
    const std::size_t last = start_.samples[i + 1];
    const Preintegration preintegration =
        preintegrate(imu.subspan(first, last - first + 1), start_.states[i].bias, input_.noise.imu);
    add_term({std::make_unique<ImuFactor>(preintegration, input_.log.gravity_m_s2),
              {static_cast<int>(i), static_cast<int>(i) + 1}},
             nullptr);
  }
}

BatchProblem::Outcome BatchProblem::solve() {
  const bool search = phase_ == SolvePhase::kSearch;
  const LeastSquaresOptions options{.max_iterations = search ? kSearchIterations : input_.config.max_iterations,
                                    .step_tolerance = kStepTolerance,
                                    .cost_tolerance = search ? kSearchTolerance : 0.0,
                                    .settle_landmarks = true};
  LeastSquaresResult result;
  if (input_.config.solver == Solver::kSchur) {
    result = solve_with_schur(problem_, options, system_.emplace(problem_));
  } else {
    result = solve_with_ceres(problem_, options);
  }
  Outcome outcome{.status = result.status,
                  .summary = {.iterations = result.iterations,
                              .initial_cost = result.initial_cost,
                              .final_cost = result.final_cost,
                              .landmarks = static_cast<int>(landmarks_.size() + lines_.size()),
                              .observations = observations_,
                              .visual = residual_sum(0, inertial_begin_),
                              .inertial = residual_sum(inertial_begin_, prior_begin_),
                              .prior = residual_sum(prior_begin_, problem_.terms.size())}};
  for (const ResidualTerm& term : problem_.terms) outcome.summary.residuals += term.factor->num_residuals();
  for (const ParameterBlock& block : problem_.blocks) outcome.summary.parameters += block.constant ? 0 : block.dof;
  return outcome;
}

core::ResidualSum BatchProblem::residual_sum(std::size_t first, std::size_t last) const {
  core::ResidualSum sum;
  Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, core::kStateDof, 1> residuals;
  for (std::size_t t = first; t < last; ++t) {
    const ResidualTerm& term = problem_.terms[t];
    residuals.resize(term.factor->num_residuals());
    if (!evaluate(problem_, term, residuals.data())) return {.squares = std::numeric_limits<double>::quiet_NaN()};
    sum.squares += residuals.squaredNorm();
    sum.residuals += static_cast<int>(residuals.size());
  }
  return sum;
}

BatchValues BatchProblem::values() const {
  BatchValues values = start_;
  values.calibration = {.T_B_C = unpack_pose(extrinsics_.data()), .td_s = td_s_, .readout_s = readout_s_};
  for (std::size_t i = 0; i < states_.size(); ++i) values.states[i] = unpack_state(states_[i].data());
  if (spline_) {
    values.spline = spline_;
    for (std::size_t i = 0; i < values.states.size(); ++i) {
      values.states[i] = state_on_spline(input_.log.imu[values.samples[i]].t_ns);
    }
  }
  values.forget_landmarks();
  for (std::size_t i = 0; i < landmarks_.size(); ++i) values.landmarks[landmark_tracks_[i]] = landmarks_[i];
  for (std::size_t i = 0; i < lines_.size(); ++i) values.lines[line_tracks_[i]] = lines_[i];
  return values;
}

std::optional<core::PosteriorCovariance> BatchProblem::covariance() {
  if (!system_) system_.emplace(problem_);
  const EstimateWhat& free = input_.config.estimate;
  if (!spline_) return posterior_covariance(*system_, free);
  return posterior_covariance(*system_, free, newest_state_by_columns(*system_, calibration_columns(free)));
}

}  // namespace plumbline::estimator
