#include "sim/spline_trajectory.h"

#include <algorithm>
#include <cmath>

#include "core/rotation_spline.h"

namespace plumbline::sim {

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
  const core::bspline::Weights w = core::bspline::weights(kOrder, u, knot_interval_s_);
  std::array<Eigen::Vector3d, 3> p;
  core::RotationSpline::Steps steps;
  for (std::size_t d = 0; d < 3; ++d) {
    p[d].setZero();
    for (std::size_t j = 0; j < kOrder; ++j) p[d] += w.plain[d][static_cast<int>(j)] * positions_[first + j];
  }
  for (std::size_t j = 1; j < kOrder; ++j) steps[j] = steps_[first + j - 1];
  core::RotationSpline rotation(kOrder, orientations_[first], steps);
  rotation.to(w);
  return {.T_W_B = {rotation.q().normalized(), p[0]},
          .v_W = p[1],
          .a_W = p[2],
          .omega_B = rotation.omega(),
          .alpha_B = rotation.alpha()};
}

}  // namespace plumbline::sim
