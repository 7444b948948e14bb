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
}

bool LocalMotion::at(double tau_s, const core::ImuBias& bias, LocalPose& pose, LocalPoseJacobians* jacobians) const {
  if (nodes_.size() < 2 || !(tau_s >= nodes_.front().tau_s && tau_s <= nodes_.back().tau_s)) return false;
  // The last node at or before tau, but for the very end, which belongs to the last step. Samples are about equally
  // spaced, so the guess is right or next to right.
  const double span_s = nodes_.back().tau_s - nodes_.front().tau_s;
  const double steps = static_cast<double>(nodes_.size() - 1);
  auto n = static_cast<std::size_t>((tau_s - nodes_.front().tau_s) / span_s * steps);
  n = std::min(n, nodes_.size() - 2);
  while (n > 0 && tau_s < nodes_[n].tau_s) --n;
  while (n + 2 < nodes_.size() && tau_s >= nodes_[n + 1].tau_s) ++n;
  const Node& node = nodes_[n];
  const Node& after = nodes_[n + 1];
  const ImuIncrement& x = node.increment;
  const double dt = after.tau_s - node.tau_s;
  const double u = tau_s - node.tau_s;

  // The node at the bias that is asked for.
  const Eigen::Vector3d d_bg = bias.gyro_rad_s - bias_.gyro_rad_s;
  const Eigen::Vector3d d_ba = bias.accel_m_s2 - bias_.accel_m_s2;
  const Eigen::Vector3d correction = x.R_bg * d_bg;
  const Eigen::Matrix3d R0 = x.R * core::exp_so3(correction);
  const Eigen::Vector3d v0 = x.v + x.v_bg * d_bg + x.v_ba * d_ba;
  const Eigen::Vector3d p0 = x.p + x.p_bg * d_bg + x.p_ba * d_ba;

  // The step from the node to tau, the samples linear in between.
  const Eigen::Vector3d gyro_slope = (after.sample.gyro_rad_s - node.sample.gyro_rad_s) / dt;
  const Eigen::Vector3d accel_slope = (after.sample.accel_m_s2 - node.sample.accel_m_s2) / dt;
  const Eigen::Vector3d w0 = node.sample.gyro_rad_s - bias.gyro_rad_s;
  const Eigen::Vector3d f0 = node.sample.accel_m_s2 - bias.accel_m_s2;
  const Eigen::Vector3d f1 = f0 + u * accel_slope;
  const Eigen::Vector3d phi = u * w0 + 0.5 * u * u * gyro_slope;
  const Eigen::Matrix3d dR = core::exp_so3(phi);
  pose.R = R0 * dR;
  pose.omega = core::right_jacobian_times(phi, w0 + u * gyro_slope);
  const Eigen::Vector3d a = 0.5 * (R0 * f0 + pose.R * f1);
  const Eigen::Vector3d a_dot = 0.5 * (pose.R * (pose.omega.cross(f1) + accel_slope));
  pose.p = p0 + u * v0 + 0.5 * u * u * a;
  pose.p_dot = v0 + u * a + 0.5 * u * u * a_dot;
  if (jacobians == nullptr) return true;

  const Eigen::Matrix3d R0_bg = core::right_jacobian(correction) * x.R_bg;
  jacobians->R_bg = dR.transpose() * R0_bg - u * core::right_jacobian(phi);
  const Eigen::Matrix3d a_bg = -0.5 * (R0 * core::skew(f0) * R0_bg + pose.R * core::skew(f1) * jacobians->R_bg);
  jacobians->p_bg = x.p_bg + u * x.v_bg + 0.5 * u * u * a_bg;
  jacobians->p_ba = x.p_ba + u * x.v_ba - 0.25 * u * u * (R0 + pose.R);
  return true;
}

}  // namespace plumbline::estimator
