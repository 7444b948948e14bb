#include "eval/association.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <limits>
#include <optional>

namespace plumbline::eval {
namespace {

using core::StampedPose;
using core::TimeNs;
using Poses = std::vector<StampedPose>;

core::Pose interpolate(const StampedPose& a, const StampedPose& b, TimeNs t_ns) {
  const double s = core::to_seconds(t_ns - a.t_ns) / core::to_seconds(b.t_ns - a.t_ns);
  return {a.T_W_B.q.slerp(s, b.T_W_B.q), (1.0 - s) * a.T_W_B.p + s * b.T_W_B.p};
}

TimeNs median_interval(const Poses& poses) {
  std::vector<TimeNs> intervals;
  for (std::size_t i = 1; i < poses.size(); ++i) intervals.push_back(poses[i].t_ns - poses[i - 1].t_ns);
  if (intervals.empty()) return 0;
  const auto middle = intervals.begin() + std::ssize(intervals) / 2;
  std::nth_element(intervals.begin(), middle, intervals.end());
  return *middle;
}

// The truth at an instant, and where it comes from.
struct TrueAt {
  core::Pose pose;
  std::optional<std::size_t> index;  // of the true pose that it is; nothing where it is interpolated
  TimeNs off_ns = 0;                 // between the instant and that pose, or between the poses interpolated
};

// `after` is the first true pose that is not before t_ns.
std::optional<TrueAt> true_pose(const Poses& truth, std::size_t after, TimeNs t_ns, TimeNs tolerance_ns) {
  if (after < truth.size() && truth[after].t_ns == t_ns) return TrueAt{truth[after].T_W_B, after, 0};
  if (after > 0 && after < truth.size()) {
    const TimeNs bridged_ns = truth[after].t_ns - truth[after - 1].t_ns;
    if (bridged_ns <= kMaxBridgedNs) {
      return TrueAt{interpolate(truth[after - 1], truth[after], t_ns), std::nullopt, bridged_ns};
    }
  }
  const bool before_is_nearer =
      after == truth.size() || (after > 0 && t_ns - truth[after - 1].t_ns <= truth[after].t_ns - t_ns);
  const std::size_t nearest = before_is_nearer ? after - 1 : after;
  const TimeNs off_ns = std::abs(t_ns - truth[nearest].t_ns);
  return off_ns <= tolerance_ns ? std::optional(TrueAt{truth[nearest].T_W_B, nearest, off_ns}) : std::nullopt;
}

// The share of the sorted, non-empty `truth` that `pairs` cover.
double covered_share(const std::vector<PosePair>& pairs, const Poses& truth, TimeNs tolerance_ns, TimeNs max_gap_ns) {
  constexpr TimeNs kNever = std::numeric_limits<TimeNs>::max() / 4;
  std::size_t after = 0;
  int covered = 0;
  for (const StampedPose& t : truth) {
    while (after < pairs.size() && pairs[after].t_ns < t.t_ns) ++after;
    const TimeNs to_next = after < pairs.size() ? pairs[after].t_ns - t.t_ns : kNever;
    const TimeNs to_last = after > 0 ? t.t_ns - pairs[after - 1].t_ns : kNever;
    const bool met = std::min(to_next, to_last) <= tolerance_ns;
    covered += met || to_next + to_last <= max_gap_ns ? 1 : 0;
  }
  return covered / static_cast<double>(truth.size());
}

}  // namespace

Association associate(const Poses& estimate, const Poses& truth, TimeNs tolerance_ns) {
  Association result;
  if (estimate.empty() || truth.empty()) return result;

  std::size_t after = 0;
  std::optional<TrueAt> last;  // of the last pair
  for (std::size_t k = 0; k < estimate.size(); ++k) {
    const TimeNs t_ns = estimate[k].t_ns;
    while (after < truth.size() && truth[after].t_ns < t_ns) ++after;
    const auto match = true_pose(truth, after, t_ns, tolerance_ns);
    if (!match) continue;
    const bool rivals = last && match->index && match->index == last->index;
    if (rivals && match->off_ns >= last->off_ns) continue;
    if (rivals) result.pairs.pop_back();
    result.pairs.push_back({t_ns, estimate[k].T_W_B, match->pose, k});
    if (!match->index) {
      ++result.interpolated;
      result.largest_bridged_s = std::max(result.largest_bridged_s, core::to_seconds(match->off_ns));
    }
    last = match;
  }
  result.coverage = covered_share(result.pairs, truth, tolerance_ns, 3 * median_interval(estimate));
  return result;
}

}  // namespace plumbline::eval
