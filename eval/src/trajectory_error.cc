#include "eval/trajectory_error.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "core/lie.h"
#include "eval/statistics.h"

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

nlohmann::ordered_json to_json(const ErrorStatistics& s) {
  return {{"rmse", s.rmse}, {"mean", s.mean}, {"median", s.median}, {"std", s.std}, {"min", s.min}, {"max", s.max}};
}

}  // namespace

ErrorStatistics error_statistics(const std::vector<double>& errors) {
  const double m = mean(errors);
  double sum2 = 0.0;
  for (const double e : errors) sum2 += (e - m) * (e - m);
  const auto [min, max] = std::minmax_element(errors.begin(), errors.end());
  return {.rmse = root_mean_square(errors),
          .mean = m,
          .median = median(errors),
          .std = std::sqrt(sum2 / static_cast<double>(errors.size())),
          .min = *min,
          .max = *max};
}

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
  const AlignmentResult alignment = align(estimate, truth, options.alignment, options.first_n);
  if (!alignment.ok) return failed(alignment.reason, pairs.size(), 1.0);

  TrajectoryErrors result;
  result.matched = static_cast<int>(pairs.size());
  result.coverage = 1.0;
  result.truth_from_estimate = alignment.truth_from_estimate;
  std::vector<double> position_m;
  std::vector<double> rotation_deg;
  for (const PosePair& pair : pairs) {
    const core::Pose aligned = alignment.truth_from_estimate * pair.estimate;
    const PoseError error{aligned.p - pair.truth.p, core::log_so3(pair.truth.q.conjugate() * aligned.q)};
    result.errors.push_back(error);
    position_m.push_back(error.position_m.norm());
    rotation_deg.push_back(error.rotation_rad.norm() * core::kDegreesPerRadian);
  }
  result.position_m = error_statistics(position_m);
  result.rotation_deg = error_statistics(rotation_deg);
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
    return failed(fmt::format("coverage {:.1f} % where {:g} % is needed ({} of {} poses matched within {:g} ms)",
                              100.0 * association.coverage, 100.0 * options.min_coverage, association.pairs.size(),
                              estimate.size(), static_cast<double>(options.tolerance_ns) * 1e-6),
                  association.pairs.size(), association.coverage);
  }
  TrajectoryErrors result = trajectory_errors(association.pairs, options);
  result.coverage = association.coverage;
  return result;
}

nlohmann::ordered_json to_json(const TrajectoryErrors& errors, Alignment alignment) {
  nlohmann::ordered_json json = {{"ok", errors.ok}};
  if (!errors.ok) json["reason"] = errors.reason;
  json["alignment"] = kAlignmentNames[static_cast<std::size_t>(alignment)];
  json["matched"] = errors.matched;
  json["coverage"] = errors.coverage;
  if (errors.ok) {
    json["ate_position_m"] = to_json(errors.position_m);
    json["ate_rotation_deg"] = to_json(errors.rotation_deg);
  }
  return json;
}

}  // namespace plumbline::eval
