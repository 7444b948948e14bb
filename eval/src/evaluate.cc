#include "eval/evaluate.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <stdexcept>
#include <string_view>
#include <tuple>
#include <utility>

#include <fmt/format.h>

#include "core/lie.h"
#include "core/state.h"
#include "eval/initialisation_error.h"
#include "eval/line_error.h"
#include "eval/nees.h"
#include "eval/trajectory_error.h"

namespace plumbline::eval {
namespace {

using CovarianceTangent = Eigen::Matrix<double, core::kCovDim, 1>;

// An estimate that cannot be scored; what() is the reason.
class Unusable : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// The true state at each estimated one.
std::vector<core::State> true_states(const core::EstimateLog& estimate, const sim::GroundTruth& truth) {
  std::vector<core::State> states;
  for (const auto& [t_ns, state] : estimate.states) {
    if (truth.states.empty() || t_ns < truth.states.front().t_ns || t_ns > truth.states.back().t_ns) {
      throw Unusable(fmt::format("the state at {} ns lies outside the recording", t_ns));
    }
    states.push_back(sim::state_at(truth, t_ns));
  }
  return states;
}

// What remains of the estimate besides the poses, in the order of the posterior covariance.
CovarianceTangent unaligned_error(const core::EstimateLog& estimate, const core::RigCalibration& true_calibration,
                                  const core::State& true_last) {
  const core::RigCalibration& calibration = estimate.calibration;
  core::Intrinsics intrinsics = core::Intrinsics::Zero();
  if (calibration.intrinsics) intrinsics = *calibration.intrinsics - true_calibration.intrinsics.value();
  CovarianceTangent e;
  e << calibration.T_B_C.p - true_calibration.T_B_C.p,
      core::log_so3(true_calibration.T_B_C.q.conjugate() * calibration.T_B_C.q),
      calibration.td_s - true_calibration.td_s, calibration.readout_s - true_calibration.readout_s,
      core::minus(estimate.states.back().state, true_last), intrinsics;
  return e;
}

bool is_finite(const core::EstimateLog& estimate) {
  for (const auto& stamped : estimate.states) {
    const core::State& x = stamped.state;
    if (!x.v_W.allFinite() || !x.bias.gyro_rad_s.allFinite() || !x.bias.accel_m_s2.allFinite()) return false;
  }
  const core::RigCalibration& c = estimate.calibration;
  return c.T_B_C.p.allFinite() && c.T_B_C.q.coeffs().allFinite() && std::isfinite(c.td_s) &&
         std::isfinite(c.readout_s) && (!c.intrinsics || c.intrinsics->allFinite()) && estimate.covariance.allFinite();
}

// Indices [first, first + count) of the posterior covariance.
std::vector<int> indices(int first, int count) {
  std::vector<int> result(static_cast<std::size_t>(count));
  std::iota(result.begin(), result.end(), first);
  return result;
}

std::vector<int> joined(std::vector<int> a, const std::vector<int>& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

// The metrics of an estimate's unaligned error and its stated covariance.
class BlockMetrics {
 public:
  BlockMetrics(const core::EstimateLog& estimate, const CovarianceTangent& e)
      : e_(e), P_(estimate.covariance), is_stated_(!P_.isZero(0.0)) {}

  // With the NEES of e(block) where the estimator claims a covariance of it.
  void add(std::string_view name, double value, const std::vector<int>& block, bool claimed) {
    Metric metric{std::string(name), value};
    if (is_stated_ && claimed && !block.empty()) {
      metric.nees = stated_nees(name, e_(block), P_(block, block));
      metric.nees_dof = static_cast<int>(block.size());
    }
    metrics_.push_back(std::move(metric));
  }

  // td of the first row, td_middle - readout/2, is a function of both: its variance needs their joint covariance.
  void add_td_first(bool claimed) {
    const Eigen::RowVector2d J(1.0, -0.5);
    const Eigen::VectorXd e = J * e_.segment<2>(core::kCovTd);
    Metric metric{"td_first_error_s", e(0)};
    if (is_stated_ && claimed) {
      metric.nees = stated_nees(metric.name, e, J * P_.block<2, 2>(core::kCovTd, core::kCovTd) * J.transpose());
      metric.nees_dof = 1;
    }
    metrics_.push_back(std::move(metric));
  }

  double norm(int offset, int dof) const { return e_.segment(offset, dof).norm(); }
  double norm3(int offset) const { return e_.segment<3>(offset).norm(); }
  bool is_free(int offset, int dof) const { return !P_.block(offset, offset, dof, dof).isZero(0.0); }
  std::vector<Metric> take() { return std::move(metrics_); }

 private:
  static double stated_nees(std::string_view name, const Eigen::VectorXd& e, const Eigen::MatrixXd& P) {
    const auto value = nees(e, P);
    if (!value) throw Unusable(fmt::format("the covariance of {} is singular or indefinite", name));
    return *value;
  }

  const CovarianceTangent& e_;
  const core::PosteriorCovariance& P_;
  bool is_stated_;
  std::vector<Metric> metrics_;
};

std::vector<Metric> block_metrics(const core::EstimateLog& estimate, const CovarianceTangent& e) {
  static_assert(core::kCovReadout == core::kCovTd + 1, "add_td_first takes them together");
  constexpr int kPose = core::kCovLastState + core::kPosition;
  constexpr int kOrientation = core::kCovLastState + core::kOrientation;
  constexpr int kVelocity = core::kCovLastState + core::kVelocity;
  constexpr int kBias = core::kCovLastState + core::kGyroBias;
  BlockMetrics m(estimate, e);
  const bool extrinsics = estimate.extrinsics_estimated;
  std::vector<int> calibration;
  if (extrinsics) calibration = indices(core::kCovExtrinsicPosition, 6);
  if (estimate.td_estimated) calibration.push_back(core::kCovTd);
  if (estimate.readout_estimated) calibration.push_back(core::kCovReadout);
  const bool intrinsics = estimate.calibration.intrinsics.has_value();
  if (intrinsics) calibration = joined(std::move(calibration), indices(core::kCovIntrinsics, 4));
  std::vector<int> last;
  // Begun from scratch, an estimate has a world of its own: no NEES of what only an alignment compares.
  const bool pose = m.is_free(kPose, 6) && !estimate.initialisation;
  const bool velocity = m.is_free(kVelocity, 3) && !estimate.initialisation;
  const bool bias = m.is_free(kBias, 6);
  for (const auto& [claimed, offset, dof] :
       {std::tuple(pose, kPose, 6), std::tuple(velocity, kVelocity, 3), std::tuple(bias, kBias, 6)}) {
    if (claimed) last = joined(std::move(last), indices(offset, dof));
  }

  const double extrinsic_m = m.norm3(core::kCovExtrinsicPosition);
  const double position_m = m.norm3(kPose);
  m.add("td_error_s", e(core::kCovTd), {core::kCovTd}, estimate.td_estimated);
  m.add_td_first(estimate.td_estimated);
  m.add("readout_error_s", e(core::kCovReadout), {core::kCovReadout}, estimate.readout_estimated);
  m.add("extrinsic_position_m", extrinsic_m, indices(core::kCovExtrinsicPosition, 3), extrinsics);
  m.add("extrinsic_rotation_deg", m.norm3(core::kCovExtrinsicRotation) * core::kDegreesPerRadian,
        indices(core::kCovExtrinsicRotation, 3), extrinsics);
  m.add("extrinsic", extrinsic_m, indices(core::kCovExtrinsicPosition, 6), extrinsics);
  if (intrinsics) {
    m.add("focal_error_px", m.norm(core::kCovIntrinsics, 2), indices(core::kCovIntrinsics, 2), true);
    m.add("principal_point_error_px", m.norm(core::kCovIntrinsics + 2, 2), indices(core::kCovIntrinsics + 2, 2), true);
    m.add("intrinsics", m.norm(core::kCovIntrinsics, 4), indices(core::kCovIntrinsics, 4), true);
  }
  m.add("calibration", extrinsic_m, calibration, true);
  m.add("final_pose", position_m, indices(kPose, 6), pose);
  m.add("final_position", position_m, indices(kPose, 3), pose);
  m.add("final_orientation_deg", m.norm3(kOrientation) * core::kDegreesPerRadian, indices(kOrientation, 3), pose);
  m.add("final_velocity", m.norm3(kVelocity), indices(kVelocity, 3), velocity);
  m.add("final_gyro_bias", m.norm3(kBias), indices(kBias, 3), m.is_free(kBias, 3));
  m.add("final_accel_bias", m.norm3(kBias + 3), indices(kBias + 3, 3), m.is_free(kBias + 3, 3));
  m.add("final_bias", m.norm3(kBias), indices(kBias, 6), bias);
  m.add("final_state", position_m, last, true);
  m.add("joint", position_m, joined(calibration, last), true);
  return m.take();
}

// Nothing where the estimator keeps no history.
std::optional<Metric> td_convergence(const core::EstimateLog& estimate, double td_s, double bound_s) {
  const auto& history = estimate.td_history;
  if (history.empty()) return std::nullopt;
  const std::optional<core::TimeNs> settled = td_settles_at(history, td_s, bound_s);
  const core::TimeNs t_ns = settled.value_or(history.back().t_ns);
  Metric metric{std::string(kTdConvergence), core::to_seconds(t_ns - estimate.states.front().t_ns)};
  metric.censored = !settled;
  return metric;
}

// What began from scratch, in the truth's world.
core::EstimateLog in_true_world(core::EstimateLog estimate, const std::vector<PosePair>& pairs) {
  std::vector<Eigen::Vector3d> estimated;
  std::vector<Eigen::Vector3d> truth;
  for (const PosePair& pair : pairs) {
    estimated.push_back(pair.estimate.p);
    truth.push_back(pair.truth.p);
  }
  const Similarity T = align(estimated, truth, Alignment::kPosyaw).truth_from_estimate;
  for (core::StampedState& s : estimate.states) {
    s.state.T_W_B = T * s.state.T_W_B;
    s.state.v_W = T.R * s.state.v_W;
  }
  return estimate;
}

// On the grid of a series.
std::vector<OnlinePoint> online_points(const core::EstimateLog& estimate, const sim::GroundTruth& truth) {
  std::vector<core::TimeNs> stamps;
  stamps.reserve(estimate.state_history.size());
  for (const core::OnlineState& s : estimate.state_history) stamps.push_back(s.t_ns);
  std::vector<OnlinePoint> points;
  for (const int k : grid_indices(stamps)) {
    const core::OnlineState& s = estimate.state_history[static_cast<std::size_t>(k)];
    if (s.t_ns < truth.states.front().t_ns || s.t_ns > truth.states.back().t_ns) {
      throw Unusable(fmt::format("the online state at {} ns lies outside the recording", s.t_ns));
    }
    const core::StateTangent e = core::minus(s.state, sim::state_at(truth, s.t_ns));
    const auto block = [&](int offset, int dof) {
      const auto value = nees(e.segment(offset, dof), s.covariance.block(offset, offset, dof, dof));
      if (!value) throw Unusable(fmt::format("the online covariance at {} ns is singular or indefinite", s.t_ns));
      return *value;
    };
    const core::StateTangent sigma = s.covariance.diagonal().cwiseSqrt();
    points.push_back({.t_s = core::to_seconds(s.t_ns - estimate.states.front().t_ns),
                      .position_sigma_m = sigma.segment<3>(core::kPosition),
                      .orientation_sigma_rad = sigma.segment<3>(core::kOrientation),
                      .position_nees = block(core::kPosition, 3),
                      .orientation_nees = block(core::kOrientation, 3),
                      .pose_nees = block(core::kPosition, 6),
                      .velocity_nees = block(core::kVelocity, 3),
                      .bias_nees = block(core::kGyroBias, 6)});
  }
  return points;
}

void score(const core::EstimateLog& estimate, const sim::GroundTruth& truth, const MetricsConfig& config,
           TrialResult& result) {
  const std::vector<core::State> states = true_states(estimate, truth);
  std::vector<PosePair> pairs;
  pairs.reserve(states.size());
  for (std::size_t k = 0; k < states.size(); ++k) {
    pairs.push_back({estimate.states[k].t_ns, estimate.states[k].state.T_W_B, states[k].T_W_B});
  }
  const TrajectoryErrors ate =
      trajectory_errors(pairs, {.alignment = config.alignment, .first_n = config.first_n, .first_s = config.first_s});
  if (!ate.ok) throw Unusable(ate.reason);
  if (!is_finite(estimate)) throw Unusable("a velocity, bias, calibration or covariance is not finite");

  const CovarianceTangent e = unaligned_error(estimate.initialisation ? in_true_world(estimate, pairs) : estimate,
                                              truth.calibration, states.back());
  result.metrics = block_metrics(estimate, e);
  result.metrics.insert(result.metrics.begin(),
                        {{"ate_position_m", ate.position_m.rmse}, {"ate_rotation_deg", ate.rotation_deg.rmse}});
  for (const auto& [name, sum] :
       {std::pair("nis_visual", estimate.summary.visual), std::pair("nis_inertial", estimate.summary.inertial)}) {
    if (sum.residuals > 0) result.metrics.push_back({name, sum.squares / sum.residuals});
  }
  if (estimate.line_tracks > 0) {
    const LineErrors lines = line_errors(estimate, truth);
    if (lines.lines > 0) {
      result.metrics.push_back({std::string(kLineAngle), lines.angle_deg});
      result.metrics.push_back({std::string(kLineDistance), lines.distance_m});
    }
    result.metrics.push_back({std::string(kLineShare), lines.share});
  }
  if (estimate.initialisation) {
    std::ranges::move(initialisation_errors(*estimate.initialisation, truth), std::back_inserter(result.metrics));
  }
  if (estimate.restarts) result.metrics.push_back({"restarts", static_cast<double>(*estimate.restarts)});
  if (estimate.knots) {
    result.metrics.push_back({"knot_interval_s", estimate.knots->interval_s});
    result.metrics.push_back({"knot_excess", estimate.knots->excess_sigmas});
  }
  if (auto convergence = td_convergence(estimate, truth.calibration.td_s, config.td_bound_s)) {
    result.metrics.push_back(std::move(*convergence));
  }
  result.series = make_series(pairs, ate, estimate.td_history, truth.calibration.td_s);
  if (!estimate.initialisation) result.series.online = online_points(estimate, truth);
  for (const Metric& metric : result.metrics) {
    if (!std::isfinite(metric.value)) throw Unusable(metric.name + " overflows");
  }
}

}  // namespace

TrialResult evaluate(const core::EstimateLog& estimate, const sim::GroundTruth& truth, const MetricsConfig& config) {
  TrialResult result;
  const core::SolveSummary& summary = estimate.summary;
  result.solver = {.iterations = summary.iterations,
                   .final_cost = summary.final_cost,
                   .cost_per_dof = summary.cost_per_dof(),
                   .observations = summary.observations,
                   .landmarks = summary.landmarks};
  result.status = core::kSolveStatusNames[static_cast<std::size_t>(estimate.status)];
  result.reason = estimate.reason;
  if (estimate.status != core::SolveStatus::kConverged) return result;
  try {
    if (!std::isfinite(summary.final_cost)) throw Unusable("the final cost is not finite");
    score(estimate, truth, config, result);
    result.ok = true;
  } catch (const Unusable& unusable) {
    result.metrics.clear();
    result.series = {};
    result.status = "unusable";
    result.reason = unusable.what();
  }
  return result;
}

}  // namespace plumbline::eval
