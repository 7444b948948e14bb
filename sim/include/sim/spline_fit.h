// Least-squares fit of a SplineTrajectory to recorded poses.
//   min sum_k |p(t_k) - p_k|^2 + |Log(R(t_k)^T R_k)|^2
// over the poses in [start_s, start_s + speed_up duration_s] (and a few knots beyond, where the file has them). Time 0
// of the trajectory is start_s into the file, and it runs speed_up times as fast as the file.
#pragma once

#include <vector>

#include "core/pose_file.h"
#include "sim/spline_trajectory.h"

namespace plumbline::sim {

// Times of the file in seconds after its first pose: all of it, or its longest piece without a gap.
struct PoseSpan {
  double from_s = 0.0;
  double to_s = 0.0;
};

struct SplineFit {
  SplineTrajectory trajectory;
  FitResiduals residuals;
  PoseSpan span;  // start_s counts from its beginning
};

// The orientation's fit repeats the linear one on the tangent space, with the basis values as its Jacobian, until the
// update vanishes; that is exact to second order in the rotation between neighbouring knots.
// Throws core::RuleError where the file is too short, or has a gap wider than largest_gap_s that config.on_gap does not
// step around.
SplineFit fit_spline(const std::vector<core::StampedPose>& poses, const TrajectoryConfig& config, double duration_s);

}  // namespace plumbline::sim
