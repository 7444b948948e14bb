// Quintic (C^4) uniform B-spline: positions in R^3, orientations as a cumulative B-spline on
// SO(3).
//   p(t) = sum_j B_j(u) p_{i+j}            R(t) = R_i prod_{j=1..5} Exp(lambda_j(u) Log(R_{i+j-1}^T R_{i+j}))
// (core/rotation_spline.h)
#pragma once

#include <array>
#include <vector>

#include "core/bspline_basis.h"
#include "sim/trajectory.h"

namespace plumbline::sim {

class SplineTrajectory final : public Trajectory {
 public:
  // Control poses, one each knot_interval_s; the first segment [0, knot_interval_s] belongs to controls 0..5.
  SplineTrajectory(const std::vector<core::Pose>& controls, double knot_interval_s);

  Kinematics at(double t_s) const override;
  double end_s() const { return static_cast<double>(positions_.size() - 5) * knot_interval_s_; }

 private:
  static constexpr int kOrder = core::bspline::kMostOrder;
  struct Segment {
    std::size_t first;  // control
    double u;           // in [0, 1]
  };
  Segment segment(double t_s) const;

  std::vector<Eigen::Vector3d> positions_;
  std::vector<Eigen::Quaterniond> orientations_;
  std::vector<Eigen::Vector3d> steps_;  // Log(R_{i}^T R_{i+1})
  double knot_interval_s_;
};

}  // namespace plumbline::sim
