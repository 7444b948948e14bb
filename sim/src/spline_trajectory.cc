#include "sim/spline_trajectory.h"

#include <algorithm>
#include <cmath>

#include "sim/bspline_basis.h"

namespace plumbline::sim {

using bspline::Basis;
using bspline::blending;
using bspline::cumulative_blending;
using bspline::kOrder;
using bspline::powers;

SplineTrajectory::SplineTrajectory(const std::vector<core::Pose>& controls, double knot_interval_s)
    : knot_interval_s_(knot_interval_s) {
  for (const core::Pose& pose : controls) {
    positions_.push_back(pose.p);
    orientations_.push_back(pose.q);
  }
  for (std::size_t i = 0; i + 1 < orientations_.size(); ++i) {
    steps_.push_back(core::log_so3(Eigen::Quaterniond(orientations_[i].conjugate() * orientations_[i + 1])));
  }
}

SplineTrajectory::Segment SplineTrajectory::segment(double t_s) const {
  const double knots = t_s / knot_interval_s_;
  const double last = static_cast<double>(positions_.size() - kOrder);
  const double first = std::clamp(std::floor(knots), 0.0, last);
  return {static_cast<std::size_t>(first), knots - first};
}

Kinematics SplineTrajectory::at(double t_s) const {
  const auto [first, u] = segment(t_s);
  const double rate = 1.0 / knot_interval_s_;
  const std::array<Basis, 3> u_powers = {powers(u, 0), powers(u, 1) * rate, powers(u, 2) * (rate * rate)};

  Kinematics k;
  std::array<Eigen::Vector3d, 3> p;
  for (std::size_t d = 0; d < 3; ++d) {
    const Basis b = blending() * u_powers[d];
    p[d].setZero();
    for (std::size_t j = 0; j < kOrder; ++j) p[d] += b[static_cast<int>(j)] * positions_[first + j];
  }

  const Basis lambda = cumulative_blending() * u_powers[0];
  const Basis d_lambda = cumulative_blending() * u_powers[1];
  const Basis dd_lambda = cumulative_blending() * u_powers[2];
  Eigen::Quaterniond q = orientations_[first];
  Eigen::Vector3d omega = Eigen::Vector3d::Zero();
  Eigen::Vector3d alpha = Eigen::Vector3d::Zero();
  for (int j = 1; j < kOrder; ++j) {
    const Eigen::Vector3d& step = steps_[first + static_cast<std::size_t>(j) - 1];
    const Eigen::Quaterniond A = core::exp_quaternion(lambda[j] * step);
    q = q * A;
    omega = A.conjugate() * omega + d_lambda[j] * step;
    alpha = A.conjugate() * alpha + d_lambda[j] * omega.cross(step) + dd_lambda[j] * step;
  }
  return {.T_W_B = {q.normalized(), p[0]}, .v_W = p[1], .a_W = p[2], .omega_B = omega, .alpha_B = alpha};
}

core::Pose SplineTrajectory::pose_at(double t_s) const {
  const auto [first, u] = segment(t_s);
  const Basis u_powers = powers(u, 0);
  const Basis b = blending() * u_powers;
  const Basis lambda = cumulative_blending() * u_powers;
  Eigen::Vector3d p = b[0] * positions_[first];
  Eigen::Quaterniond q = orientations_[first];
  for (int j = 1; j < kOrder; ++j) {
    const std::size_t i = first + static_cast<std::size_t>(j);
    p += b[j] * positions_[i];
    q = q * core::exp_quaternion(lambda[j] * steps_[i - 1]);
  }
  return {q.normalized(), p};
}

}  // namespace plumbline::sim
