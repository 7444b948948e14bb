// Pairs of estimated and true poses of the same instant, one to one: an estimated pose takes the true pose of the
// nearest stamp within the tolerance; where two would take the same, the nearer has it (of equals the earlier).
//
//   coverage = min( matched / min(n_e, n_t),  share of the true poses that are covered )
//   n_e: estimated poses within the truth's time span;  n_t: true poses within the estimate's
//   covered: between two matched poses in a row that are at most three of the estimate's median intervals apart
// The first share falls where stamps do not meet, the second where the estimate starts late, has gaps or stops early.
// Neither asks the two files for the same rate, nor keyframes for even intervals.
#pragma once

#include <vector>

#include "core/lie.h"
#include "core/pose_file.h"
#include "core/time.h"

namespace plumbline::eval {

struct PosePair {
  core::TimeNs t_ns = 0;  // of the estimate
  core::Pose estimate;    // T_W_B
  core::Pose truth;       // T_W_B
};

struct Association {
  std::vector<PosePair> pairs;  // by increasing stamp
  double coverage = 0.0;        // in [0, 1]
};

// Equal stamps are the usual case; half a millisecond forgives rounded text and costs at most half a millimetre of
// error at 1 m/s.
inline constexpr core::TimeNs kDefaultToleranceNs = 500'000;

// Both with strictly increasing stamps.
Association associate(const std::vector<core::StampedPose>& estimate, const std::vector<core::StampedPose>& truth,
                      core::TimeNs tolerance_ns = kDefaultToleranceNs);

}  // namespace plumbline::eval
