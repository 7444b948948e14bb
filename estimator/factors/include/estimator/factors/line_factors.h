// Segments observed of a line: for each of the two observed ends its distance from the line's image, over sigma_px
// (line_residual.h). The line is a block of orthonormal_line.h about a constant origin of its own (world, metres).
//
//   CameraLineFactor       blocks: T_W_C, line
//   VelocityLineFactor     blocks: state, extrinsics, td, readout, line; camera timing `feature_velocity`:
//     b_k(td) = b_k - (td - td_k + (row_k - rows/2)/rows readout) v_k,   dr_k/dtd = -(n_c.v_k)/m
//     row_k the observed row, v_k the velocity of the end point on the normalised plane, td_k the td with which the
//     state's time was formed. Of v only the part across the line counts.
//   PropagatedLineFactor   the same blocks; camera timing `propagated`:
//     an end point of row v is exposed at s_k + tau(v), tau(v) = (t_cam,k - s_k) + td + (v - rows/2)/rows readout, and
//     sees the line from the body's pose then (local_motion.h). All that the line may be seen at is the curve
//       F(u, v) = n_c(tau(v)) . b(u, v) = 0
//     and r is the signed distance of the observed end point from it: along grad F, at the foot of the perpendicular.
//
// The row of `propagated` is that of the foot, not the observed one. What of the pixel's noise lies across the curve
// is the residual; were it in the time as well, it would be in the derivatives by td and readout, correlated with the
// residual, and bias both. The noise along the curve cannot be told from the unknown place of the end on the line, and
// is independent of the residual. Since r is a distance along the normal of the true curve (the chord's normal turned
// by the flow), it has the pixel's variance exactly to first order. And by the envelope theorem
//   dr/dx = (dF/dx at the foot, held fixed) / |grad F|,   grad F = D^T n_c,xy + (0, dF/dtau readout/rows)
// With no readout this is CameraLineFactor at the pose at tau; at r = 0 and no motion all three agree.
//
// A factor is false (Ceres rejects the step) where n or d of the line vanishes, the image is at infinity, a time leaves
// the local motion, or the line moves with the shutter, so that the curve has no normal.
#pragma once

#include <array>
#include <optional>

#include <ceres/sized_cost_function.h>

#include "estimator/factors/line_residual.h"
#include "estimator/factors/orthonormal_line.h"
#include "estimator/factors/parameter_blocks.h"
#include "estimator/factors/point_factors.h"

namespace plumbline::estimator {

class CameraLineFactor final : public ceres::SizedCostFunction<2, kPoseSize, kLineSize> {
 public:
  CameraLineFactor(const CameraModel& model, const Eigen::Vector3d& origin_W, const SegmentPixels& observed);

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override;

 private:
  double inv_sigma_px_;
  Eigen::Vector3d origin_W_;
  std::array<LineEndPoint, 2> ends_;
};

// Of each end: (dx/dt, dy/dt) on the normalised plane, 1/s.
using SegmentVelocities = std::array<Eigen::Vector2d, 2>;

class VelocityLineFactor final : public ceres::SizedCostFunction<2, kStateSize, kPoseSize, 1, 1, kLineSize> {
 public:
  VelocityLineFactor(const CameraModel& model, const Eigen::Vector3d& origin_W, const SegmentPixels& observed,
                     const SegmentVelocities& velocities, double td_k_s);

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override;

 private:
  double inv_sigma_px_;
  int rows_;
  double td_k_s_;
  Eigen::Vector3d origin_W_;
  std::array<LineEndPoint, 2> ends_;
  SegmentVelocities velocities_;
};

class PropagatedLineFactor final : public ceres::SizedCostFunction<2, kStateSize, kPoseSize, 1, 1, kLineSize> {
 public:
  PropagatedLineFactor(const CameraModel& model, FrameTiming frame, const Eigen::Vector3d& origin_W,
                       const SegmentPixels& observed);

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override;

  // The observed ends moved onto the curve. Nothing where Evaluate is false.
  std::optional<SegmentPixels> feet(double const* const* parameters) const;

 private:
  CameraModel model_;
  FrameTiming frame_;
  Eigen::Vector3d origin_W_;
  std::array<LineEndPoint, 2> ends_;
};

}  // namespace plumbline::estimator
