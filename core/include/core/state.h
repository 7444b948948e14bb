// The state of the body at one instant, its perturbation, and the standard deviations of a prior on it.
//   tangent order:  [ p (m, world) | theta (rad, body, right) | v (m/s, world) | b_g (rad/s) | b_a (m/s^2) ]
#pragma once

#include <Eigen/Core>

#include "core/lie.h"

namespace plumbline::core {

struct ImuBias {
  Eigen::Vector3d gyro_rad_s = Eigen::Vector3d::Zero();
  Eigen::Vector3d accel_m_s2 = Eigen::Vector3d::Zero();
};

struct State {
  Pose T_W_B;
  Eigen::Vector3d v_W = Eigen::Vector3d::Zero();  // m/s, of the body's origin in the world
  ImuBias bias;
};

// Offsets of the blocks in the tangent space of a state.
inline constexpr int kPosition = 0;
inline constexpr int kOrientation = 3;
inline constexpr int kVelocity = 6;
inline constexpr int kGyroBias = 9;
inline constexpr int kAccelBias = 12;
inline constexpr int kStateDof = 15;
using StateTangent = Eigen::Matrix<double, kStateDof, 1>;

// x [+] d: positions, velocity and biases add, R <- R Exp(d_theta).
inline State plus(const State& x, const StateTangent& d) {
  State y = x;
  y.T_W_B.p += d.segment<3>(kPosition);
  y.T_W_B.q = (x.T_W_B.q * exp_quaternion(d.segment<3>(kOrientation))).normalized();
  y.v_W += d.segment<3>(kVelocity);
  y.bias.gyro_rad_s += d.segment<3>(kGyroBias);
  y.bias.accel_m_s2 += d.segment<3>(kAccelBias);
  return y;
}

// y [-] x, so that x [+] (y [-] x) = y.
inline StateTangent minus(const State& y, const State& x) {
  StateTangent d;
  d.segment<3>(kPosition) = y.T_W_B.p - x.T_W_B.p;
  d.segment<3>(kOrientation) = log_so3(x.T_W_B.q.conjugate() * y.T_W_B.q);
  d.segment<3>(kVelocity) = y.v_W - x.v_W;
  d.segment<3>(kGyroBias) = y.bias.gyro_rad_s - x.bias.gyro_rad_s;
  d.segment<3>(kAccelBias) = y.bias.accel_m_s2 - x.bias.accel_m_s2;
  return d;
}

struct StateSigmas {
  double position_m = 0.0;
  double orientation_rad = 0.0;
  double velocity_m_s = 0.0;
  double gyro_bias_rad_s = 0.0;
  double accel_bias_m_s2 = 0.0;

  StateTangent per_axis() const {
    StateTangent s;
    s << Eigen::Vector3d::Constant(position_m), Eigen::Vector3d::Constant(orientation_rad),
        Eigen::Vector3d::Constant(velocity_m_s), Eigen::Vector3d::Constant(gyro_bias_rad_s),
        Eigen::Vector3d::Constant(accel_bias_m_s2);
    return s;
  }
};

struct CalibrationSigmas {
  double td_s = 0.0;  // middle row
  double readout_s = 0.0;
  double extrinsic_position_m = 0.0;
  double extrinsic_rotation_rad = 0.0;
  double focal_px = 0.0;  // fx and fy, each
  double principal_point_px = 0.0;

  bool has_intrinsics() const { return focal_px > 0.0 || principal_point_px > 0.0; }
};

}  // namespace plumbline::core
