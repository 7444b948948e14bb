// Reprojection of a point in a BAL camera (core/bal_camera.h), as files of BAL hold it (looking down -z), in pixels:
//   r = project(R X + t) - (u, v)_observed                                    A = d project/d P_C
//   d r/d t = A        d r/d X = A R        d r/d(f, k1, k2) as in core/bal_camera.h
// in two forms, which differ in the rotation only:
//   BalFactor      rotation vector w, additive as in the files:  d r/d w = -A [R X]x Jl(w)
//   BalLeftFactor  quaternion, perturbed R <- Exp(dw) R:         d r/d w = -A [R X]x
// The additive form is as the problems are published; it is singular at |w| = 2 pi, the other one nowhere.
#pragma once

#include <ceres/product_manifold.h>
#include <ceres/sized_cost_function.h>

#include "core/bal_camera.h"
#include "core/bal_file.h"

namespace plumbline::estimator {

inline constexpr int kBalCameraSize = 9;       // [ w | t | f k1 k2 ]
inline constexpr int kBalLeftCameraSize = 10;  // [ q_C_W (x y z w) | t | f k1 k2 ]
using BalCameraBlock = Eigen::Matrix<double, kBalCameraSize, 1>;
using BalLeftCameraBlock = Eigen::Matrix<double, kBalLeftCameraSize, 1>;

BalCameraBlock pack(const core::BalCamera& camera);
BalLeftCameraBlock pack_left(const core::BalCamera& camera);
core::BalCamera unpack_bal_camera(const BalCameraBlock& block);
core::BalCamera unpack_bal_camera(const BalLeftCameraBlock& block);

// Unit quaternions x, y, z, w perturbed on the left by the whole angle: Plus(q, d) = Exp(d) * q,
// Minus(y, x) = Log(y * x^-1). The one place that leaves the project's perturbation on the right.
class LeftSo3Manifold final : public ceres::Manifold {
 public:
  int AmbientSize() const override { return 4; }
  int TangentSize() const override { return 3; }
  bool Plus(const double* x, const double* delta, double* x_plus_delta) const override;
  bool PlusJacobian(const double* x, double* jacobian) const override;
  bool Minus(const double* y, const double* x, double* y_minus_x) const override;
  bool MinusJacobian(const double* x, double* jacobian) const override;
};
using BalLeftCameraManifold = ceres::ProductManifold<LeftSo3Manifold, ceres::EuclideanManifold<6>>;

// Blocks: camera, point. False (Ceres rejects the step) where the point lies in the plane of the camera's centre.
class BalFactor final : public ceres::SizedCostFunction<2, kBalCameraSize, 3> {
 public:
  explicit BalFactor(const Eigen::Vector2d& observed_px, core::ViewAxis axis = core::ViewAxis::kMinusZ)
      : observed_px_(observed_px), axis_(axis) {}

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override;

 private:
  Eigen::Vector2d observed_px_;
  core::ViewAxis axis_;
};

class BalLeftFactor final : public ceres::SizedCostFunction<2, kBalLeftCameraSize, 3> {
 public:
  explicit BalLeftFactor(const Eigen::Vector2d& observed_px, core::ViewAxis axis = core::ViewAxis::kMinusZ)
      : observed_px_(observed_px), axis_(axis) {}

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override;

 private:
  Eigen::Vector2d observed_px_;
  core::ViewAxis axis_;
};

}  // namespace plumbline::estimator
