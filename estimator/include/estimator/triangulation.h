// A landmark's first value from poses that are known roughly.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "core/camera.h"
#include "core/lie.h"

namespace plumbline::estimator {

struct View {
  core::Pose T_W_C;  // at the time of the observation
  Eigen::Vector2d pixel;
};

// (x, y, lambda) in the first view's camera: the bearing as observed, and the inverse depth that minimises the
// algebraic distance of the other views. With q(lambda) = a + lambda c the point in a view (any positive scale),
//   lambda = - sum (c_xy - z c_z).(a_xy - z a_z) / sum |c_xy - z c_z|^2
// kept within [farthest, nearest] plausible depth, 100 m and 0.2 m, where parallax says little or the poses are off.
Eigen::Vector3d triangulate(const core::PinholeCamera& camera, const std::vector<View>& views);

}  // namespace plumbline::estimator
