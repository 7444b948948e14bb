// Point observations with camera timing `propagated`: the law of timed_point.h with the body's poses carried by the IMU
// from the states of anchor and observer (timed_body.h).
#pragma once

#include <ceres/sized_cost_function.h>

#include "core/camera.h"
#include "estimator/factors/landmark.h"
#include "estimator/factors/parameter_blocks.h"
#include "estimator/factors/ray_chart.h"
#include "estimator/factors/timed_body.h"
#include "estimator/factors/timed_point.h"

namespace plumbline::estimator {

// dr/d(fx, fy, cx, cy) of r = pixel/sigma_px where a point is seen; a row that moves moves the time. J_td = dr/dtd.
inline Eigen::Matrix<double, 2, kIntrinsicsSize> intrinsics_jacobian(const CameraModel& model,
                                                                     const Eigen::Vector2d& pixel, double readout_s,
                                                                     const Eigen::Vector2d& J_td) {
  const Eigen::Matrix<double, 2, kIntrinsicsSize> J = model.camera.intrinsics_jacobian(pixel);
  return J / model.pixel_sigma_px + (readout_s / model.camera.height_px) * J_td * J.row(1);
}

// Blocks: anchor state, observer state, extrinsics, td, readout, landmark. False (Ceres rejects the step) where the law
// is, or a time leaves the range of the local motion.
template <LandmarkType kLandmark>
class PropagatedPoint final
    : public ceres::SizedCostFunction<2, kStateSize, kStateSize, kPoseSize, 1, 1, landmark_size(kLandmark)> {
 public:
  PropagatedPoint(const CameraModel& model, FrameTiming anchor, FrameTiming observer,
                  const Eigen::Vector2d& observed_pixel)
    requires(kLandmark == LandmarkType::kBearingInverseDepth)
      : law_(model, observed_pixel),
        gravity_m_s2_(model.gravity_m_s2),
        anchor_(std::move(anchor)),
        observer_(std::move(observer)) {}

  PropagatedPoint(const CameraModel& model, FrameTiming anchor, FrameTiming observer,
                  const Eigen::Vector2d& observed_pixel, const Eigen::Vector2d& anchor_pixel)
    requires(kLandmark == LandmarkType::kFixedBearing)
      : law_(model, observed_pixel, anchor_pixel),
        gravity_m_s2_(model.gravity_m_s2),
        anchor_(std::move(anchor)),
        observer_(std::move(observer)) {}

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override;

 private:
  TimedPoint<kLandmark> law_;
  double gravity_m_s2_;
  FrameTiming anchor_;
  FrameTiming observer_;
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
