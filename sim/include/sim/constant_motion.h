// Motion with a constant body rate: at rest, constant twist (a helix), or constant acceleration of the world's.
//   R(t) = Exp(omega t)
//   p(t) = v_W t + 1/2 a_W t^2 + V(t) v_B,    V(t) = int_0^t Exp(omega s) ds = t J_l(omega t)
// The velocity is v_W + a_W t + R(t) v_B. The motions along which td, or parts of the extrinsics, cannot be told.
#pragma once

#include <Eigen/Core>

#include "sim/trajectory.h"

namespace plumbline::sim {

class ConstantMotion final : public Trajectory {
 public:
  struct Parameters {
    Eigen::Vector3d omega_B = Eigen::Vector3d::Zero();
    Eigen::Vector3d v_B = Eigen::Vector3d::Zero();
    Eigen::Vector3d v_W = Eigen::Vector3d::Zero();
    Eigen::Vector3d a_W = Eigen::Vector3d::Zero();
  };

  explicit ConstantMotion(const Parameters& parameters) : c_(parameters) {}

  Kinematics at(double t_s) const override;

 private:
  Parameters c_;
};

ConstantMotion::Parameters constant_twist(const ConstantMotionConfig& config);
ConstantMotion::Parameters constant_acceleration(const ConstantMotionConfig& config);

}  // namespace plumbline::sim
