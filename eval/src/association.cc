#include "eval/association.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iterator>

namespace plumbline::eval {
namespace {

using core::StampedPose;
using core::TimeNs;
using Poses = std::vector<StampedPose>;

bool is_before(const StampedPose& pose, TimeNs t_ns) { return pose.t_ns < t_ns; }

// Of sorted, non-empty poses.
std::size_t nearest(const Poses& poses, TimeNs t_ns) {
  const auto after = std::lower_bound(poses.begin(), poses.end(), t_ns, is_before);
  if (after == poses.begin()) return 0;
  const auto index = static_cast<std::size_t>(after - poses.begin());
  return after == poses.end() || t_ns - poses[index - 1].t_ns <= after->t_ns - t_ns ? index - 1 : index;
}

std::int64_t count_within(const Poses& poses, TimeNs first_ns, TimeNs last_ns) {
  return std::count_if(poses.begin(), poses.end(),
                       [&](const StampedPose& p) { return p.t_ns >= first_ns && p.t_ns <= last_ns; });
}

TimeNs median_interval(const Poses& poses) {
  std::vector<TimeNs> intervals;
  for (std::size_t i = 1; i < poses.size(); ++i) intervals.push_back(poses[i].t_ns - poses[i - 1].t_ns);
  if (intervals.empty()) return 0;
  const auto middle = intervals.begin() + std::ssize(intervals) / 2;
  std::nth_element(intervals.begin(), middle, intervals.end());
  return *middle;
}

}  // namespace

Association associate(const Poses& estimate, const Poses& truth, TimeNs tolerance_ns) {
  Association result;
  if (estimate.empty() || truth.empty()) return result;

  Poses matched;  // the true poses taken
  for (const StampedPose& e : estimate) {
    const StampedPose& t = truth[nearest(truth, e.t_ns)];
    const TimeNs gap = std::abs(e.t_ns - t.t_ns);
    if (gap > tolerance_ns) continue;
    const PosePair pair{e.t_ns, e.T_W_B, t.T_W_B};
    if (matched.empty() || matched.back().t_ns != t.t_ns) {
      matched.push_back(t);
      result.pairs.push_back(pair);
    } else if (gap < std::abs(result.pairs.back().t_ns - t.t_ns)) {
      result.pairs.back() = pair;
    }
  }
  if (matched.empty()) return result;

  const auto possible =
      std::min(count_within(estimate, truth.front().t_ns - tolerance_ns, truth.back().t_ns + tolerance_ns),
               count_within(truth, estimate.front().t_ns - tolerance_ns, estimate.back().t_ns + tolerance_ns));
  const TimeNs max_gap_ns = 3 * median_interval(estimate);
  const auto covered = std::count_if(truth.begin(), truth.end(), [&](const StampedPose& t) {
    const auto after = std::lower_bound(matched.begin(), matched.end(), t.t_ns, is_before);
    if (after == matched.end()) return false;
    return after->t_ns == t.t_ns || (after != matched.begin() && after->t_ns - std::prev(after)->t_ns <= max_gap_ns);
  });
  result.coverage = std::min(static_cast<double>(matched.size()) / static_cast<double>(possible),
                             static_cast<double>(covered) / static_cast<double>(truth.size()));
  return result;
}

}  // namespace plumbline::eval
