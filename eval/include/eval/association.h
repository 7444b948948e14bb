// Pairs of estimated and true poses of the same instant, one to one. The truth is taken at the estimate's stamp:
//   exact          a true pose has that very stamp
//   interpolated   between the two true poses around it, positions linearly, orientations by SLERP, where these are at
//                  most kMaxBridgedNs apart; off by a dt^2 / 8 at the acceleration a (5 mm at 1 m/s^2 and 0.2 s)
//   nearest        elsewhere a true pose within the tolerance; where two estimates would take the same one, the nearer
//                  has it (of equals the earlier)
// An estimated pose without any of these has no pair.
//
//   coverage = share of the true poses that are covered
//   covered: within the tolerance of a matched estimate, or between two matched ones in a row that are at most three
//   of the estimate's median intervals apart
// It falls where the estimate starts late, has gaps or stops early, and does not ask the two files for the same rate.
#pragma once

#include <vector>

#include "core/lie.h"
#include "core/pose_file.h"
#include "core/time.h"

namespace plumbline::eval {

struct PosePair {
  core::TimeNs t_ns = 0;           // of the estimate
  core::Pose estimate;             // T_W_B
  core::Pose truth;                // T_W_B
  std::size_t estimate_index = 0;  // in the estimate that was associated
};

struct Association {
  std::vector<PosePair> pairs;     // by increasing stamp
  double coverage = 0.0;           // in [0, 1]
  int interpolated = 0;            // of the pairs
  double largest_bridged_s = 0.0;  // of the intervals between true poses that were interpolated over
};

// Equal stamps are the usual case; half a millisecond forgives rounded text and costs at most half a millimetre of
// error at 1 m/s.
inline constexpr core::TimeNs kDefaultToleranceNs = 500'000;
inline constexpr core::TimeNs kMaxBridgedNs = 200'000'000;

// Both with strictly increasing stamps.
Association associate(const std::vector<core::StampedPose>& estimate, const std::vector<core::StampedPose>& truth,
                      core::TimeNs tolerance_ns = kDefaultToleranceNs);

}  // namespace plumbline::eval
