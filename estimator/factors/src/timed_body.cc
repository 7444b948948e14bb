#include "estimator/factors/timed_body.h"

namespace plumbline::estimator {

bool BodyPath::at(double tau_s, TimedBody& body) {
  if (!found_ || !step_.contains(tau_s)) found_ = motion_.find_step(tau_s, state_.bias, step_);
  if (!found_) return false;
  tau_s_ = tau_s;
  local_ = step_.at(tau_s);
  body.R.noalias() = R_k_ * local_.R;
  body.p = state_.T_W_B.p + tau_s * state_.v_W + (0.5 * tau_s * tau_s) * gravity_W_;
  body.p.noalias() += R_k_ * local_.p;
  body.velocity = state_.v_W + tau_s * gravity_W_;
  body.velocity.noalias() += R_k_ * local_.p_dot;
  body.omega = local_.omega;
  return true;
}

}  // namespace plumbline::estimator
