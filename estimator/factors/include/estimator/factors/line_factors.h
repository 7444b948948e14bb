// Segments observed of a line: for each of the two observed ends its distance from the line's image, over sigma_px
// (line_residual.h). The line is a block of orthonormal_line.h about a constant origin of its own (world, metres).
//
//   CameraLineFactor       blocks: T_W_C, line
//   VelocityLineFactor     blocks: state, extrinsics, td, readout, line; camera timing `feature_velocity`:
//     b_k(td) = b_k - (td - td_k + (row_k - rows/2)/rows readout) v_k,   dr_k/dtd = -(n_c.v_k)/m
//     row_k the observed row, v_k the velocity of the end point on the normalised plane, td_k the td with which the
//     state's time was formed. Of v only the part across the line counts.
//   PropagatedLineFactor   the same blocks; camera timing `propagated`: the law of timed_line.h, with the body
//     carried by the IMU from the state (timed_body.h)
//
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
#include "estimator/factors/timed_line.h"

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
                       const SegmentPixels& observed)
      : law_(model, origin_W, observed), gravity_m_s2_(model.gravity_m_s2), frame_(std::move(frame)) {}

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override;

  // The observed ends moved onto the curve. Nothing where Evaluate is false.
  std::optional<SegmentPixels> feet(double const* const* parameters) const;

 private:
  TimedLine law_;
  double gravity_m_s2_;
  FrameTiming frame_;
};

}  // namespace plumbline::estimator
