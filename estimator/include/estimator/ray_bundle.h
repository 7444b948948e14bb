// Bundle adjustment of rays: poses and points such that the points lie where the rays point.
//   r = (q_xy / q_z - z) / sigma,   q = R_k^T (X - c_k)
#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Core>
#include <ceres/sized_cost_function.h>

#include "core/lie.h"
#include "estimator/factors/parameter_blocks.h"

namespace plumbline::estimator {

class RayFactor final : public ceres::SizedCostFunction<2, kPoseSize, 3> {
 public:
  RayFactor(const Eigen::Vector2d& ray, double sigma) : ray_(ray), sigma_(sigma) {}
  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override;

 private:
  Eigen::Vector2d ray_;
  double sigma_;
};

struct RaySight {
  std::size_t pose = 0;
  Eigen::Vector2d ray;
};

struct RayPoint {
  Eigen::Vector3d X;
  std::vector<RaySight> sights;
};

// With a Cauchy loss; the first pose stays, and so does the scale but for rounding, since nothing asks for another.
// False where it does not converge.
bool adjust_rays(std::vector<core::Pose>& poses, std::vector<RayPoint>& points, double sigma);

}  // namespace plumbline::estimator
