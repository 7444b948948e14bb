// The two parts of an attitude error that differ in what a visual-inertial estimator can observe. The error as a
// rotation of the world, dR = R_est R_truth^T, is a turn about z after a tilt,  dR = Exp(yaw e_z) tilt,  where the axis
// of the tilt is horizontal:
//   yaw      2 atan2(q_z, q_w)                                in (-pi, pi]
//   gravity  2 atan2(|(q_x, q_y)|, |(q_z, q_w)|)              in [0, pi]: the angle between dR e_z and e_z, which is
//            that between the two directions of gravity seen from the body
// and cos(angle/2) = cos(yaw/2) cos(gravity/2). Upside down (q_z = q_w = 0) yaw means nothing and is 0.
// rpg_trajectory_evaluation takes the yaw of z-y-x Euler angles instead, which is the same to first order.
#pragma once

#include <cmath>

#include <Eigen/Geometry>

namespace plumbline::eval {

struct AttitudeError {
  double yaw_rad = 0.0;
  double gravity_rad = 0.0;
};

inline AttitudeError attitude_error(const Eigen::Quaterniond& estimate, const Eigen::Quaterniond& truth) {
  const Eigen::Quaterniond dq = estimate * truth.conjugate();
  const double sign = dq.w() < 0.0 ? -1.0 : 1.0;
  return {.yaw_rad = 2.0 * std::atan2(sign * dq.z(), sign * dq.w()),
          .gravity_rad = 2.0 * std::atan2(std::hypot(dq.x(), dq.y()), std::hypot(dq.z(), dq.w()))};
}

}  // namespace plumbline::eval
