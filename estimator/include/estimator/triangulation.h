// A landmark's first value from poses that are known roughly.
#pragma once

#include <optional>
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

// The same where some views may be of something else: from two of them, first and last, first and middle or middle and
// last, whichever most agree with, and then from all that agree (within gate_px). Nothing where fewer than half do.
std::optional<Eigen::Vector3d> triangulate_agreeing(const core::PinholeCamera& camera, const std::vector<View>& views,
                                                    double gate_px);

}  // namespace plumbline::estimator
