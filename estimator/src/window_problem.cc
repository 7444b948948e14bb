// The window's least-squares problem: building it, solving it, and what its solution speaks against.
#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include "estimator/posterior.h"
#include "estimator/schur_system.h"
#include "estimator/window.h"
#include "window_built.h"

namespace plumbline::estimator {

// A point's depth is never less certain than this [1/m], whatever the parallax: nothing is nearer than some
// centimetres.
constexpr double kDepthInformation = 1e-2;
// Nor is a line's place within its plane, in units of what is known of each of its coordinates alone.
constexpr double kLineInformation = 1e-10;

int Window::Built::add(double* values, int size, int dof, const ceres::Manifold* manifold) {
  const int block = static_cast<int>(problem.blocks.size());
  problem.blocks.push_back({.values = values, .size = size, .dof = dof, .manifold = manifold});
  index.emplace(values, block);
  return block;
}

void Window::add_calibration(Built& built) {
  const EstimateWhat& free = config_.estimate;
  built.extrinsics = built.add(extrinsics_.data(), kPoseSize, 6, &pose_manifold_);
  built.problem.first_shared = built.extrinsics;
  built.problem.blocks.back().constant = !free.extrinsics;
  built.td = built.add(&td_s_, 1, 1, nullptr);
  built.problem.blocks.back().constant = !free.td;
  built.readout = built.add(&readout_s_, 1, 1, nullptr);
  built.problem.blocks.back().constant = !free.readout;
  if (free.intrinsics) built.intrinsics = built.add(intrinsics_.data(), kIntrinsicsSize, kIntrinsicsSize, nullptr);
}

std::array<int, kMostBlocks> Window::point_blocks(const WindowPoint& point, const WindowObservation& o, int landmark,
                                                  const Built& built, int& count) const {
  std::array<int, kMostBlocks> blocks = {};
  std::size_t n = 0;
  blocks[n++] = built.of(point.anchor->x.data());
  if (!is_free_point() || o.frame != point.anchor) blocks[n++] = built.of(o.frame->x.data());
  for (const int calibration : {built.extrinsics, built.td, built.readout}) blocks[n++] = calibration;
  blocks[n++] = landmark;
  if (built.intrinsics >= 0) blocks[n++] = built.intrinsics;
  count = static_cast<int>(n);
  return blocks;
}

// Nothing where the point has no value, or where too few observations say something of it.
void Window::add_point_terms(WindowPoint& point, Built& built, const WindowFrame* only_of) {
  if (!point.has_value) return;
  const auto used = [&](const WindowObservation& o) {
    return o.factor != nullptr && (only_of == nullptr || o.frame == only_of);
  };
  const auto n = std::count_if(point.observations.begin(), point.observations.end(), used);
  int landmark = built.find(point.landmark.data());
  if (landmark < 0) {
    if (n < (is_free_point() ? 2 : 1)) return;
    double* const values = is_free_point() ? point.landmark.data() : &point.landmark.z();
    const int size = is_free_point() ? kLandmarkSize : 1;
    landmark = built.add(values, size, size, nullptr);
    built.problem.blocks.back().eliminated = true;
    built.problem.blocks.back().last_information = kDepthInformation;
  }
  if (!point.depth_is_known && only_of == nullptr) {
    built.problem.terms.push_back({.factor = usual_depth(), .blocks = {landmark}, .count = 1});
  }
  for (const WindowObservation& o : point.observations) {
    if (!used(o)) continue;
    ResidualTerm term{.factor = o.factor.get(), .loss = loss_.get()};
    term.blocks = point_blocks(point, o, landmark, built, term.count);
    built.problem.terms.push_back(term);
  }
}

// Two views spend their four rows on the line's four degrees of freedom.
void Window::add_line_terms(WindowLine& line, Built& built) {
  if (!line.value || line.observations.size() < 3) return;
  const int block = built.add(line.value->block.data(), kLineSize, kLineDof, &line_manifold_);
  built.problem.blocks.back().eliminated = true;
  built.problem.blocks.back().share_of_information = kLineInformation;
  for (const WindowLineObservation& o : line.observations) {
    ResidualTerm term{.factor = o.factor.get(), .count = 5, .loss = loss_.get()};
    term.blocks = {built.of(o.frame->x.data()), built.extrinsics, built.td, built.readout, block};
    built.problem.terms.push_back(term);
  }
}

void Window::add_inertial_term(std::size_t i, Built& built) {
  ResidualTerm term{.factor = frames_[i]->inertial.get(), .count = 2};
  term.blocks = {built.of(frames_[i - 1]->x.data()), built.of(frames_[i]->x.data())};
  built.problem.terms.push_back(term);
}

Window::Built Window::build_all() {
  Built built;
  for (auto& [id, point] : points_) {
    if (point.in_prior) built.add(point.landmark.data(), kLandmarkSize, kLandmarkSize, nullptr);
  }
  for (const auto& frame : frames_) built.add(frame->x.data(), kStateSize, core::kStateDof, &state_manifold_);
  add_calibration(built);
  for (auto& [id, point] : points_) add_point_terms(point, built);
  for (auto& [id, line] : lines_) add_line_terms(line, built);
  built.visual_terms = built.problem.terms.size();
  // The terms of an eliminated landmark stand together; those of one that is not may stand anywhere.
  for (std::size_t i = 1; i < frames_.size(); ++i) add_inertial_term(i, built);
  if (prior_ != nullptr) {
    built.problem.prior = prior_.get();
    for (const double* values : prior_values_) built.problem.prior_blocks.push_back(built.of(values));
  } else {
    for (const InitialTerm& initial : initial_) {
      ResidualTerm term{.factor = initial.factor.get(), .count = 1};
      term.blocks = {built.of(initial.block)};
      built.problem.terms.push_back(term);
    }
  }
  return built;
}

LeastSquares Window::problem() { return build_all().problem; }

WindowSolution Window::solve(bool doubtful) {
  // The biases' effect on a preintegrated rotation is linear to half the square of this [rad].
  constexpr double kRelineariseRad = 1e-5;
  for (std::size_t i = 1; i < frames_.size(); ++i) {
    const core::State before = unpack_state(frames_[i - 1]->x.data());
    const double dt_s = core::to_seconds(log_.imu[frames_[i]->sample].t_ns - log_.imu[frames_[i - 1]->sample].t_ns);
    const double moved = (before.bias.gyro_rad_s - frames_[i]->inertial_bias.gyro_rad_s).norm();
    if (moved * dt_s > kRelineariseRad) make_inertial(i);
  }
  Built built = build_all();
  if (doubtful) {
    for (std::size_t t = 0; t < built.visual_terms; ++t) built.problem.terms[t].loss = doubtful_loss_.get();
  }
  // Steps of Gauss and Newton: after one of half a standard deviation, in all dimensions together, what is left is a
  // small share of that.
  const LeastSquaresOptions options{.max_iterations = config_.max_iterations, .step_tolerance = 0.5};
  SchurSystem system(built.problem);
  WindowSolution solution;
  if (config_.solver == Solver::kSchur) {
    solution.result = solve_with_schur(built.problem, options, system);
  } else {
    solution.result = solve_with_ceres(built.problem, options);
  }
  solution.observations = static_cast<int>(built.visual_terms);
  if (doubtful || solution.result.status == core::SolveStatus::kDiverged) return solution;

  solution.covariance = posterior_covariance(system, config_.estimate);
  return solution;
}

std::optional<double> Window::relative_scale_sigma() {
  const Built built = build_all();
  SchurSystem system(built.problem);
  if (!system.build(0.0) || !system.solve()) return std::nullopt;
  const std::vector<core::StampedState> states = this->states();
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const core::StampedState& s : states) mean += s.state.T_W_B.p / static_cast<double>(states.size());
  Eigen::VectorXd w = Eigen::VectorXd::Zero(system.columns());
  double squares = 0.0;
  for (const auto& frame : frames_) {
    if (!frame->frame) continue;
    const Eigen::Vector3d arm = frame->x.head<3>() - mean;
    w.segment<3>(system.column(built.of(frame->x.data())) + core::kPosition) = arm;
    squares += arm.squaredNorm();
  }
  // H = L L^T, so that w^T H^-1 w = |L^-1 w|^2.
  const Eigen::MatrixXd L = system.trailing_factor(system.columns());
  return L.triangularView<Eigen::Lower>().solve(w).norm() / squares;
}

WindowFit Window::assess(bool reject) {
  WindowFit fit;
  const double limit = config_.window.outlier_sigma * config_.window.outlier_sigma;
  const Built built = build_all();
  std::set<const ceres::CostFunction*> outliers;
  for (std::size_t t = 0; t < built.visual_terms; ++t) {
    const ResidualTerm& term = built.problem.terms[t];
    if (term.factor == usual_depth()) continue;
    Eigen::Vector2d residual;
    const bool known = evaluate(built.problem, term, residual.data());
    const double squares = residual.squaredNorm();
    if (!known || !(squares <= limit)) {
      outliers.insert(term.factor);
      continue;
    }
    fit.visual.squares += squares;
    fit.visual.residuals += 2;
  }
  fit.outliers = static_cast<int>(outliers.size());
  if (!reject || outliers.empty()) return fit;
  const auto is_outlier = [&](const auto& o) { return o.factor != nullptr && outliers.contains(o.factor.get()); };
  for (auto& [id, point] : points_) {
    const auto n = std::erase_if(point.observations, is_outlier);
    point.rejected += static_cast<int>(n);
  }
  for (auto& [id, line] : lines_) {
    if (std::any_of(line.observations.begin(), line.observations.end(), is_outlier)) {
      line.value.reset();
      line.observations.clear();
    }
  }
  return fit;
}

}  // namespace plumbline::estimator
