// Point observations with camera timing `propagated`: time offset and rolling shutter by the trajectory.
//
// Both ends of the chain of point_chain.h move: T_j is the observer's body when its predicted row is exposed
// (rolling_view.h), T_i the anchor's when that of its bearing is, s_i + tau_i,
//   tau_i = (t_cam,i - s_i) + td + (v - rows/2)/rows * readout
// v the row of the estimated bearing (bearing_inverse_depth), or as measured (fixed_bearing).
//   r = h(q) - h(observed),  h of ray_chart.h
//   dr/dtd = J_W (R_i (omega_i x B) + lambda v_i) + h' M q'_j,   dr/dreadout the same, each end times (v - rows/2)/rows
#pragma once

#include <ceres/sized_cost_function.h>

#include "core/camera.h"
#include "estimator/factors/landmark.h"
#include "estimator/factors/parameter_blocks.h"
#include "estimator/factors/ray_chart.h"
#include "estimator/factors/rolling_view.h"
#include "estimator/factors/timed_body.h"

namespace plumbline::estimator {

struct CameraModel {
  core::PinholeCamera camera = {};
  double pixel_sigma_px = 1.0;
  double gravity_m_s2 = 9.81;
  ResidualType residual = ResidualType::kPinhole;
};

// dr/d(fx, fy, cx, cy) of r = pixel/sigma_px where a point is seen; a row that moves moves the time. J_td = dr/dtd.
inline Eigen::Matrix<double, 2, kIntrinsicsSize> intrinsics_jacobian(const CameraModel& model,
                                                                     const Eigen::Vector2d& pixel, double readout_s,
                                                                     const Eigen::Vector2d& J_td) {
  const Eigen::Matrix<double, 2, kIntrinsicsSize> J = model.camera.intrinsics_jacobian(pixel);
  return J / model.pixel_sigma_px + (readout_s / model.camera.height_px) * J_td * J.row(1);
}

// Blocks: anchor state, observer state, extrinsics, td, readout, landmark. False (Ceres rejects the step) where the
// landmark is not in front of the observer, or a time leaves the range of the local motion.
template <LandmarkType kLandmark>
class PropagatedPoint final
    : public ceres::SizedCostFunction<2, kStateSize, kStateSize, kPoseSize, 1, 1, landmark_size(kLandmark)> {
 public:
  PropagatedPoint(const CameraModel& model, FrameTiming anchor, FrameTiming observer,
                  const Eigen::Vector2d& observed_pixel)
    requires(kLandmark == LandmarkType::kBearingInverseDepth)
      : PropagatedPoint(model, std::move(anchor), std::move(observer), observed_pixel, Fixed{}) {}

  PropagatedPoint(const CameraModel& model, FrameTiming anchor, FrameTiming observer,
                  const Eigen::Vector2d& observed_pixel, const Eigen::Vector2d& anchor_pixel)
    requires(kLandmark == LandmarkType::kFixedBearing)
      : PropagatedPoint(model, std::move(anchor), std::move(observer), observed_pixel,
                        Fixed{model.camera.unproject(anchor_pixel), anchor_pixel.y()}) {}

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override;

 private:
  // The anchor's observation where it is taken as exact.
  struct Fixed {
    Eigen::Vector3d bearing = Eigen::Vector3d::UnitZ();
    double row = 0.0;
  };
  struct Anchor;  // bearing, inverse depth and row, from the landmark's block

  PropagatedPoint(const CameraModel& model, FrameTiming anchor, FrameTiming observer,
                  const Eigen::Vector2d& observed_pixel, const Fixed& fixed)
      : camera_(model.camera),
        chart_(model.residual, model.camera, model.pixel_sigma_px, observed_pixel),
        gravity_m_s2_(model.gravity_m_s2),
        anchor_(std::move(anchor)),
        observer_(std::move(observer)),
        measured_row_(observed_pixel.y()),
        fixed_(fixed) {}

  bool find_anchor(const double* landmark, Anchor& anchor) const;

  core::PinholeCamera camera_;
  RayChart chart_;
  double gravity_m_s2_;
  FrameTiming anchor_;
  FrameTiming observer_;
  double measured_row_;
  Fixed fixed_;
};

extern template class PropagatedPoint<LandmarkType::kBearingInverseDepth>;
extern template class PropagatedPoint<LandmarkType::kFixedBearing>;
using PropagatedPointFactor = PropagatedPoint<LandmarkType::kBearingInverseDepth>;

// The anchor's own observation of a landmark bearing_inverse_depth: r = h((x, y, 1)) - h(observed). Block: landmark.
class AnchorPointFactor final : public ceres::SizedCostFunction<2, kLandmarkSize> {
 public:
  AnchorPointFactor(const CameraModel& model, const Eigen::Vector2d& observed_pixel)
      : chart_(model.residual, model.camera, model.pixel_sigma_px, observed_pixel) {}

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override;

 private:
  RayChart chart_;
};

}  // namespace plumbline::estimator
