#include "estimator/factors/local_motion.h"

#include <algorithm>

#include "core/lie.h"
#include "core/time.h"

namespace plumbline::estimator {

LocalMotion::LocalMotion(std::span<const core::ImuSample> samples, std::size_t state_index, double reach_s,
                         const core::ImuBias& bias)
    : bias_(bias) {
  const core::TimeNs t0 = samples[state_index].t_ns;
  const auto tau = [&](std::size_t i) { return core::to_seconds(samples[i].t_ns - t0); };

  ImuIncrement increment;
  for (std::size_t i = state_index; i > 0 && tau(i) > -reach_s; --i) {
    advance(samples[i], samples[i - 1], bias, tau(i - 1) - tau(i), increment);
    nodes_.push_back({tau(i - 1), samples[i - 1], increment});
  }
  std::reverse(nodes_.begin(), nodes_.end());
  increment = {};
  nodes_.push_back({0.0, samples[state_index], increment});
  for (std::size_t i = state_index; i + 1 < samples.size() && tau(i) < reach_s; ++i) {
    advance(samples[i], samples[i + 1], bias, tau(i + 1) - tau(i), increment);
    nodes_.push_back({tau(i + 1), samples[i + 1], increment});
  }
  const double span_s = nodes_.back().tau_s - nodes_.front().tau_s;
  if (span_s > 0.0) nodes_per_s_ = static_cast<double>(nodes_.size() - 1) / span_s;
}

bool LocalMotion::find_step(double tau_s, const core::ImuBias& bias, LocalStep& step) const {
  if (nodes_.size() < 2 || !(tau_s >= nodes_.front().tau_s && tau_s <= nodes_.back().tau_s)) return false;
  // The last node at or before tau, but for the very end, which belongs to the last step. Samples are about equally
  // spaced, so the guess is right or next to right.
  auto n = static_cast<std::size_t>((tau_s - nodes_.front().tau_s) * nodes_per_s_);
  n = std::min(n, nodes_.size() - 2);
  while (n > 0 && tau_s < nodes_[n].tau_s) --n;
  while (n + 2 < nodes_.size() && tau_s >= nodes_[n + 1].tau_s) ++n;
  const Node& node = nodes_[n];
  const Node& after = nodes_[n + 1];
  const ImuIncrement& x = node.increment;

  // The node at the bias that is asked for.
  const Eigen::Vector3d d_bg = bias.gyro_rad_s - bias_.gyro_rad_s;
  const Eigen::Vector3d d_ba = bias.accel_m_s2 - bias_.accel_m_s2;
  const Eigen::Vector3d correction = x.R_bg * d_bg;
  step.x_ = &x;
  step.tau0_s_ = node.tau_s;
  step.tau1_s_ = after.tau_s;
  step.Jr_correction_ = core::right_jacobian(correction);
  step.R0_.noalias() = x.R * core::exp_so3(correction);
  step.v0_ = x.v + x.v_bg * d_bg + x.v_ba * d_ba;
  step.p0_ = x.p + x.p_bg * d_bg + x.p_ba * d_ba;
  step.w0_ = node.sample.gyro_rad_s - bias.gyro_rad_s;
  step.f0_ = node.sample.accel_m_s2 - bias.accel_m_s2;
  const double per_s = 1.0 / (after.tau_s - node.tau_s);
  step.gyro_slope_ = per_s * (after.sample.gyro_rad_s - node.sample.gyro_rad_s);
  step.accel_slope_ = per_s * (after.sample.accel_m_s2 - node.sample.accel_m_s2);
  return true;
}

LocalPose LocalStep::at(double tau_s) const {
  const double u = tau_s - tau0_s_;
  const double half_u2 = 0.5 * u * u;
  const Eigen::Vector3d f1 = f0_ + u * accel_slope_;
  const Eigen::Vector3d phi = angle_within(u);
  LocalPose pose;
  pose.R.noalias() = R0_ * core::exp_so3(phi);
  pose.omega = core::right_jacobian_times(phi, w0_ + u * gyro_slope_);
  const Eigen::Vector3d a = 0.5 * (R0_ * f0_ + pose.R * f1);
  const Eigen::Vector3d a_dot = 0.5 * (pose.R * (pose.omega.cross(f1) + accel_slope_));
  pose.p = p0_ + u * v0_ + half_u2 * a;
  pose.p_dot = v0_ + u * a + half_u2 * a_dot;
  return pose;
}

LocalPoseJacobians LocalStep::jacobians(double tau_s, const LocalPose& pose) const {
  const auto p = pull_back<3>(tau_s, pose, Eigen::Matrix3d::Identity(), Eigen::Matrix3d::Zero());
  const auto R = pull_back<3>(tau_s, pose, Eigen::Matrix3d::Zero(), Eigen::Matrix3d::Identity());
  return {.R_bg = R.b_g, .p_bg = p.b_g, .p_ba = p.b_a};
}

bool LocalMotion::at(double tau_s, const core::ImuBias& bias, LocalPose& pose, LocalPoseJacobians* jacobians) const {
  LocalStep step;
  if (!find_step(tau_s, bias, step)) return false;
  pose = step.at(tau_s);
  if (jacobians != nullptr) *jacobians = step.jacobians(tau_s, pose);
  return true;
}

}  // namespace plumbline::estimator
