#include "eval/evaluate.h"

#include <cmath>
#include <optional>
#include <stdexcept>
#include <string_view>

#include <fmt/format.h>

#include "core/lie.h"
#include "core/state.h"
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
  CovarianceTangent e;
  e << calibration.T_B_C.p - true_calibration.T_B_C.p,
      core::log_so3(true_calibration.T_B_C.q.conjugate() * calibration.T_B_C.q),
      calibration.td_s - true_calibration.td_s, calibration.readout_s - true_calibration.readout_s,
      core::minus(estimate.states.back().state, true_last);
  return e;
}

bool is_finite(const core::EstimateLog& estimate) {
  for (const auto& stamped : estimate.states) {
    const core::State& x = stamped.state;
    if (!x.v_W.allFinite() || !x.bias.gyro_rad_s.allFinite() || !x.bias.accel_m_s2.allFinite()) return false;
  }
  const core::RigCalibration& c = estimate.calibration;
  return c.T_B_C.p.allFinite() && c.T_B_C.q.coeffs().allFinite() && std::isfinite(c.td_s) &&
         std::isfinite(c.readout_s) && estimate.covariance.allFinite();
}

// NEES of e[offset, offset + dof), where the estimator states a covariance of it.
std::optional<double> block_nees(std::string_view name, const CovarianceTangent& e, const core::PosteriorCovariance& P,
                                 int offset, int dof) {
  const auto value = nees(e.segment(offset, dof), P.block(offset, offset, dof, dof));
  if (!value) throw Unusable(fmt::format("the covariance of {} is singular or indefinite", name));
  return value;
}

std::vector<Metric> block_metrics(const core::EstimateLog& estimate, const CovarianceTangent& e) {
  const core::PosteriorCovariance& P = estimate.covariance;
  const bool is_stated = !P.isZero(0.0);
  std::vector<Metric> metrics;
  const auto add = [&](std::string_view name, double value, int offset, int dof, bool claimed) {
    Metric metric{std::string(name), value};
    if (is_stated && claimed) {
      metric.nees = block_nees(name, e, P, offset, dof);
      metric.nees_dof = dof;
    }
    metrics.push_back(std::move(metric));
  };
  const auto norm3 = [&](int offset) { return e.segment<3>(offset).norm(); };
  const auto free = [&](int offset, int dof) { return !P.block(offset, offset, dof, dof).isZero(0.0); };

  add("td_error_s", e(core::kCovTd), core::kCovTd, 1, estimate.td_estimated);
  add("readout_error_s", e(core::kCovReadout), core::kCovReadout, 1, estimate.readout_estimated);
  const double extrinsic_m = norm3(core::kCovExtrinsicPosition);
  const double extrinsic_deg = norm3(core::kCovExtrinsicRotation) * core::kDegreesPerRadian;
  const bool extrinsics = estimate.extrinsics_estimated;
  add("extrinsic_position_m", extrinsic_m, core::kCovExtrinsicPosition, 3, extrinsics);
  add("extrinsic_rotation_deg", extrinsic_deg, core::kCovExtrinsicRotation, 3, extrinsics);
  add("extrinsic", extrinsic_m, core::kCovExtrinsicPosition, 6, extrinsics);
  constexpr int kPose = core::kCovLastState + core::kPosition;
  constexpr int kVelocity = core::kCovLastState + core::kVelocity;
  constexpr int kBias = core::kCovLastState + core::kGyroBias;
  add("final_pose", norm3(kPose), kPose, 6, free(kPose, 6));
  add("final_velocity", norm3(kVelocity), kVelocity, 3, free(kVelocity, 3));
  add("final_bias", norm3(kBias), kBias, 6, free(kBias, 6));
  return metrics;
}

void score(const core::EstimateLog& estimate, const sim::GroundTruth& truth, const MetricsConfig& config,
           TrialResult& result) {
  const std::vector<core::State> states = true_states(estimate, truth);
  std::vector<PosePair> pairs;
  pairs.reserve(states.size());
  for (std::size_t k = 0; k < states.size(); ++k) {
    pairs.push_back({estimate.states[k].t_ns, estimate.states[k].state.T_W_B, states[k].T_W_B});
  }
  const TrajectoryErrors ate = trajectory_errors(pairs, {.alignment = config.alignment, .first_n = config.first_n});
  if (!ate.ok) throw Unusable(ate.reason);
  if (!is_finite(estimate)) throw Unusable("a velocity, bias, calibration or covariance is not finite");

  const CovarianceTangent e = unaligned_error(estimate, truth.calibration, states.back());
  result.metrics = block_metrics(estimate, e);
  result.metrics.insert(result.metrics.begin(),
                        {{"ate_position_m", ate.position_m.rmse}, {"ate_rotation_deg", ate.rotation_deg.rmse}});
  result.series = make_series(pairs, ate, estimate.td_history, truth.calibration.td_s);
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
