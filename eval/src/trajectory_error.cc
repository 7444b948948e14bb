#include "eval/trajectory_error.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "core/lie.h"
#include "eval/attitude_error.h"

namespace plumbline::eval {
namespace {

bool is_finite(const core::Pose& T) { return T.p.allFinite() && T.q.coeffs().allFinite(); }

// The first reason that `poses` cannot be scored; empty where there is none.
template <class Poses, class IsFinite>
std::string unusable(const Poses& poses, const IsFinite& finite) {
  for (std::size_t k = 0; k < poses.size(); ++k) {
    if (!finite(poses[k])) return fmt::format("pose {} is not finite", k);
    if (k > 0 && poses[k].t_ns == poses[k - 1].t_ns) return fmt::format("pose {} has a duplicate stamp", k);
    if (k > 0 && poses[k].t_ns < poses[k - 1].t_ns) return fmt::format("pose {} has an unsorted stamp", k);
  }
  return {};
}

TrajectoryErrors failed(std::string reason, std::size_t matched, double coverage) {
  TrajectoryErrors result;
  result.reason = std::move(reason);
  result.matched = static_cast<int>(matched);
  result.coverage = coverage;
  return result;
}

// How many of the pairs decide the alignment; 0: all.
int deciding_pairs(const std::vector<PosePair>& pairs, const TrajectoryErrorOptions& options) {
  if (options.first_n != 0 && options.first_s != 0.0) {
    throw std::invalid_argument("trajectory_errors: first_n or first_s, not both");
  }
  if (options.first_s == 0.0) return options.first_n;
  const auto within = [&](const PosePair& p) {
    return core::to_seconds(p.t_ns - pairs.front().t_ns) <= options.first_s;
  };
  return static_cast<int>(std::count_if(pairs.begin(), pairs.end(), within));
}

AxisStatistics axis_statistics(const std::vector<PoseError>& errors, Eigen::Vector3d PoseError::* part, double unit) {
  AxisStatistics axes;
  for (const PoseError& e : errors) {
    axes.mean += e.*part;
    axes.rmse += (e.*part).cwiseAbs2();
  }
  const auto n = static_cast<double>(errors.size());
  return {.mean = unit / n * axes.mean, .rmse = unit * (axes.rmse / n).cwiseSqrt()};
}

nlohmann::ordered_json to_json(const AxisStatistics& axes) {
  const auto array = [](const Eigen::Vector3d& x) { return nlohmann::ordered_json::array({x.x(), x.y(), x.z()}); };
  return {{"mean", array(axes.mean)}, {"rmse", array(axes.rmse)}};
}

// Fills in all statistics of `result.pairs` under `result.truth_from_estimate`.
void measure(TrajectoryErrors& result, const std::vector<Delta>& deltas) {
  std::vector<double> position_m;
  std::vector<double> rotation_deg;
  std::vector<double> yaw_deg;
  std::vector<double> gravity_deg;
  std::vector<PosePair> aligned = result.pairs;
  for (PosePair& pair : aligned) {
    pair.estimate = result.truth_from_estimate * pair.estimate;
    const PoseError error{pair.estimate.p - pair.truth.p, core::log_so3(pair.truth.q.conjugate() * pair.estimate.q)};
    const AttitudeError attitude = attitude_error(pair.estimate.q, pair.truth.q);
    result.errors.push_back(error);
    position_m.push_back(error.position_m.norm());
    rotation_deg.push_back(error.rotation_rad.norm() * core::kDegreesPerRadian);
    yaw_deg.push_back(std::abs(attitude.yaw_rad) * core::kDegreesPerRadian);
    gravity_deg.push_back(attitude.gravity_rad * core::kDegreesPerRadian);
  }
  result.position_m = error_statistics(position_m);
  result.rotation_deg = error_statistics(rotation_deg);
  result.yaw_deg = error_statistics(yaw_deg);
  result.gravity_deg = error_statistics(gravity_deg);
  result.position_axes_m = axis_statistics(result.errors, &PoseError::position_m, 1.0);
  result.rotation_axes_deg = axis_statistics(result.errors, &PoseError::rotation_rad, core::kDegreesPerRadian);
  for (const Delta& delta : deltas) result.relative.push_back(relative_errors(aligned, delta));
}

}  // namespace

TrajectoryErrors trajectory_errors(const std::vector<PosePair>& pairs, const TrajectoryErrorOptions& options) {
  const auto finite = [](const PosePair& p) { return is_finite(p.estimate) && is_finite(p.truth); };
  if (auto reason = unusable(pairs, finite); !reason.empty()) return failed(std::move(reason), pairs.size(), 1.0);
  if (pairs.size() < kMinPoses) {
    return failed(fmt::format("{} poses where {} are needed", pairs.size(), kMinPoses), pairs.size(), 1.0);
  }
  std::vector<Eigen::Vector3d> estimate;
  std::vector<Eigen::Vector3d> truth;
  for (const PosePair& pair : pairs) {
    estimate.push_back(pair.estimate.p);
    truth.push_back(pair.truth.p);
  }
  const AlignmentResult alignment = align(estimate, truth, options.alignment, deciding_pairs(pairs, options));
  if (!alignment.ok) return failed(alignment.reason, pairs.size(), 1.0);

  TrajectoryErrors result;
  result.matched = static_cast<int>(pairs.size());
  result.coverage = 1.0;
  result.truth_from_estimate = alignment.truth_from_estimate;
  result.pairs = pairs;
  measure(result, options.deltas);
  if (!std::isfinite(result.position_m.rmse) || !std::isfinite(result.rotation_deg.rmse)) {
    return failed("the errors overflow", pairs.size(), 1.0);
  }
  result.ok = true;
  return result;
}

TrajectoryErrors trajectory_errors(const std::vector<core::StampedPose>& estimate,
                                   const std::vector<core::StampedPose>& truth, const TrajectoryErrorOptions& options) {
  const auto finite = [](const core::StampedPose& p) { return is_finite(p.T_W_B); };
  if (auto reason = unusable(estimate, finite); !reason.empty()) return failed("the estimate's " + reason, 0, 0.0);
  if (auto reason = unusable(truth, finite); !reason.empty()) return failed("the truth's " + reason, 0, 0.0);

  const Association association = associate(estimate, truth, options.tolerance_ns);
  if (association.coverage < options.min_coverage) {
    return failed(fmt::format("coverage {:.1f} % of the truth where {:g} % is needed ({} of {} poses have a true one)",
                              100.0 * association.coverage, 100.0 * options.min_coverage, association.pairs.size(),
                              estimate.size()),
                  association.pairs.size(), association.coverage);
  }
  TrajectoryErrors result = trajectory_errors(association.pairs, options);
  result.coverage = association.coverage;
  result.interpolated = association.interpolated;
  result.largest_bridged_s = association.largest_bridged_s;
  return result;
}

nlohmann::ordered_json to_json(const TrajectoryErrors& errors, Alignment alignment) {
  nlohmann::ordered_json json = {{"ok", errors.ok}};
  if (!errors.ok) json["reason"] = errors.reason;
  json["alignment"] = kAlignmentNames[static_cast<std::size_t>(alignment)];
  json["matched"] = errors.matched;
  json["coverage"] = errors.coverage;
  if (!errors.ok) return json;
  json["truth"] = errors.interpolated > 0 ? "interpolated" : "exact";
  json["largest_bridged_s"] = errors.largest_bridged_s;
  json["ate_position_m"] = to_json(errors.position_m);
  json["ate_rotation_deg"] = to_json(errors.rotation_deg);
  json["ate_yaw_deg"] = to_json(errors.yaw_deg);
  json["ate_gravity_deg"] = to_json(errors.gravity_deg);
  json["axes"] = {{"position_m", to_json(errors.position_axes_m)}, {"rotation_deg", to_json(errors.rotation_axes_deg)}};
  json["rpe"] = nlohmann::ordered_json::array();
  for (const RelativeErrors& relative : errors.relative) json["rpe"].push_back(to_json(relative));
  return json;
}

}  // namespace plumbline::eval
