#include "sim/constant_motion.h"

namespace plumbline::sim {

Kinematics ConstantMotion::at(double t_s) const {
  const Eigen::Vector3d theta = t_s * c_.omega_B;
  const Eigen::Quaterniond q = core::exp_quaternion(theta);
  return {.T_W_B = {q, t_s * (c_.v_W + 0.5 * t_s * c_.a_W + core::left_jacobian(theta) * c_.v_B)},
          .v_W = c_.v_W + t_s * c_.a_W + q * c_.v_B,
          .a_W = c_.a_W + q * c_.omega_B.cross(c_.v_B),
          .omega_B = c_.omega_B,
          .alpha_B = Eigen::Vector3d::Zero()};
}

ConstantMotion::Parameters constant_twist(const ConstantMotionConfig& config) {
  ConstantMotion::Parameters parameters;
  parameters.omega_B = config.rate_rad_s;
  parameters.v_B = config.velocity_body_m_s;
  return parameters;
}

ConstantMotion::Parameters constant_acceleration(const ConstantMotionConfig& config) {
  ConstantMotion::Parameters parameters;
  parameters.omega_B = config.rate_rad_s;
  parameters.v_W = config.velocity_m_s;
  parameters.a_W = config.acceleration_m_s2;
  return parameters;
}

}  // namespace plumbline::sim
