// The body at a time near a state (camera timing `propagated`), and the chain from there back to the state:
//   R(tau) = R_k dR(tau)      p(tau) = p_k + v_k tau + g tau^2/2 + R_k dp(tau)      g = (0, 0, -gravity)
// With dR, dp of local_motion.h. World frame, theta on the right.
#pragma once

#include <memory>

#include <Eigen/Core>

#include "core/state.h"
#include "estimator/factors/local_motion.h"
#include "estimator/factors/point_chain.h"
#include "estimator/factors/skew_product.h"

namespace plumbline::estimator {

// A frame as the factors see it.
struct FrameTiming {
  std::shared_ptr<const LocalMotion> motion;  // about the instant of the frame's state; only `propagated` needs it
  double offset_s = 0.0;                      // t_cam,k - s_k, so that a row is exposed at s_k + offset + td + ...
};

// T_W_B at an instant and its rates, whatever carries the body there.
struct TimedBody : RigidMotion {
  Eigen::Vector3d velocity;  // dp/dt
  Eigen::Vector3d omega;     // dR/dt = R [omega]x
};

// Poses of one state at many times, and their derivatives: remembers the last step and the last pose.
class BodyPath {
 public:
  BodyPath(const LocalMotion& motion, const core::State& state, double gravity_m_s2)
      : motion_(motion), state_(state), R_k_(state.T_W_B.q.toRotationMatrix()), gravity_W_(0.0, 0.0, -gravity_m_s2) {}

  // False where tau_s leaves the range of the local motion.
  bool at(double tau_s, TimedBody& body);

  // From the derivatives with respect to the body at the last time to those with respect to the state.
  template <int kRows>
  Eigen::Matrix<double, kRows, core::kStateDof> chain_to_state(const Eigen::Matrix<double, kRows, 3>& J_p,
                                                               const Eigen::Matrix<double, kRows, 3>& J_theta) const {
    using Rows = Eigen::Matrix<double, kRows, 3>;
    const Rows J_p_body = J_p * R_k_;
    const auto bias = step_.pull_back<kRows>(tau_s_, local_, J_p_body, J_theta);
    Eigen::Matrix<double, kRows, core::kStateDof> J;
    J.template middleCols<3>(core::kPosition) = J_p;
    J.template middleCols<3>(core::kOrientation) = -times_skew(J_p_body, local_.p);
    J.template middleCols<3>(core::kOrientation).noalias() += J_theta * local_.R.transpose();
    J.template middleCols<3>(core::kVelocity) = tau_s_ * J_p;
    J.template middleCols<3>(core::kGyroBias) = bias.b_g;
    J.template middleCols<3>(core::kAccelBias) = bias.b_a;
    return J;
  }

 private:
  const LocalMotion& motion_;
  const core::State& state_;
  Eigen::Matrix3d R_k_;
  Eigen::Vector3d gravity_W_;
  LocalStep step_;
  LocalPose local_;
  double tau_s_ = 0.0;
  bool found_ = false;
};

}  // namespace plumbline::estimator
