// Relative pose error (RPE): how the motion between two poses i, j differs from the true one. With Q true and P
// estimated poses T_W_B
//   E = (Q_i^-1 Q_j)^-1 (P_i^-1 P_j)
//   position |t(E)| [m]     rotation: the angle of R(E) [deg]     yaw (absolute value), gravity [deg]: the parts of
//   R(E) as a turn of the world at the true attitude R_Q,j (eval/attitude_error.h)
// A rigid alignment changes nothing; the scale of sim3 does. Figures by frames are those of evo.
//
// Pairs are `delta` apart: a number of poses, seconds, metres or per cent of the true path. Time and path are met by
// the pose nearest to them; a pair that is more than a tenth of delta off is left out.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "eval/association.h"
#include "eval/error_statistics.h"

namespace plumbline::eval {

enum class DeltaUnit { kFrames, kSeconds, kMetres, kPercentOfPath };

struct Delta {
  double value = 1.0;
  DeltaUnit unit = DeltaUnit::kFrames;
};

// "20f", "1s", "10m", "10%"
std::string to_string(const Delta& delta);

// Of a list such as "10m,1s,1f". Throws core::DataError for what is none: a positive number with its unit each, frames
// whole, not more than 100 %.
std::vector<Delta> parse_deltas(std::string_view text);

// Zhang & Scaramuzza's sub-trajectories of a tenth to half of the path, and one second.
inline constexpr std::string_view kDefaultDeltas = "10%,20%,30%,40%,50%,1s";

enum class PairStarts {
  kEveryPose,    // pairs overlap
  kConsecutive,  // a pair starts where the last one ended
};

struct RelativeErrors {
  Delta delta;
  int pairs = 0;  // 0: the trajectory is shorter than delta, or its poses are too sparse for it
  ErrorStatistics position_m;
  ErrorStatistics rotation_deg;
  ErrorStatistics yaw_deg;
  ErrorStatistics gravity_deg;
};

// Of sound pairs by increasing stamp.
RelativeErrors relative_errors(const std::vector<PosePair>& pairs, const Delta& delta,
                               PairStarts starts = PairStarts::kEveryPose);

// {"delta", "pairs", "position_m": {...}, "rotation_deg", "yaw_deg", "gravity_deg"}; without pairs the first two only.
nlohmann::ordered_json to_json(const RelativeErrors& errors);

}  // namespace plumbline::eval
