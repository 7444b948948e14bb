#include "estimator/factors/timed_body.h"

namespace plumbline::estimator {
namespace {

void place(const LocalPose& local, const core::State& state, const Eigen::Matrix3d& R_k,
           const Eigen::Vector3d& gravity_W, double tau_s, TimedBody& body) {
  body.local = local;
  body.R.noalias() = R_k * local.R;
  body.p = state.T_W_B.p + tau_s * state.v_W + (0.5 * tau_s * tau_s) * gravity_W;
  body.p.noalias() += R_k * local.p;
  body.velocity = state.v_W + tau_s * gravity_W;
  body.velocity.noalias() += R_k * local.p_dot;
}

}  // namespace

bool body_at(const LocalMotion& motion, const core::State& state, double gravity_m_s2, double tau_s, TimedBody& body,
             LocalPoseJacobians* jacobians) {
  LocalPose local;
  if (!motion.at(tau_s, state.bias, local, jacobians)) return false;
  place(local, state, state.T_W_B.q.toRotationMatrix(), {0.0, 0.0, -gravity_m_s2}, tau_s, body);
  return true;
}

bool BodyPath::at(double tau_s, TimedBody& body) {
  if (!found_ || !step_.contains(tau_s)) found_ = motion_.find_step(tau_s, state_.bias, step_);
  if (!found_) return false;
  tau_s_ = tau_s;
  place(step_.at(tau_s), state_, R_k_, gravity_W_, tau_s, body);
  return true;
}

}  // namespace plumbline::estimator
