// Estimated lines against the true segments that their tracks saw, in the world and not aligned.
//   angle     between the directions, modulo sign: acos |d . d_true|, in [0, 90] deg
//   distance  root mean square over the true segment's two ends P of |P x d - n|, their distance from the line [m]
// A direction alone says little of a line, and the distance of two lines is 0 where they cross: the ends of the segment
// are where the line was seen.
#pragma once

#include <vector>

#include "core/estimate.h"
#include "sim/ground_truth.h"

namespace plumbline::eval {

struct LineError {
  double angle_deg = 0.0;
  double distance_m = 0.0;
};

LineError line_error(const core::LineEstimate& line, const sim::Segment& truth);

// Medians over the lines of a trial. A track that was seen in passing leaves its line next to no direction, and a mean
// square would speak of those alone.
struct LineErrors {
  int lines = 0;  // estimated ones whose segment is known; where there is none, the errors are 0
  double angle_deg = 0.0;
  double distance_m = 0.0;
  double share = 0.0;  // estimated lines / tracks of lines that two keyframes or more saw
};

LineErrors line_errors(const core::EstimateLog& estimate, const sim::GroundTruth& truth);

}  // namespace plumbline::eval
