// Point observations under a rolling shutter with time offset, camera timing `propagated`, landmark
// `bearing_inverse_depth`: (x, y, lambda), the bearing (x, y, 1) in the anchor camera at the time when the anchor saw
// the landmark, and the inverse of its depth there.
//
// The observation of row v in frame k is made at s_k + tau, s_k the instant of the frame's state,
//   tau_k(v) = (t_cam,k - s_k) + td + (v - rows/2)/rows * readout
// where the body is at T_k(tau) (local_motion.h). With b = (x, y, 1), every length times lambda, so that a landmark at
// infinity is as good as any:
//   B = R_c b + lambda t_c            body frame of the anchor, v_a = the row of b, tau_a = tau_i(v_a)
//   W = R_i(tau_a) B + lambda p_i(tau_a)
//   X = R_j(tau_b)^T (W - lambda p_j(tau_b))
//   q = R_c^T (X - lambda t_c)        r = (project(q) - z) / sigma_px
//
// The row v_b of the observer is the *predicted* one, v_b = h_v(tau_j(v_b)): the measured row is noisy, and its noise
// would enter the time. By the implicit function theorem, with k = h_v' readout/rows (h' the image velocity, px/s),
//   dv_b/dx = (dh_v/dx at fixed tau_b) / (1 - k)      dr/dx = M (dh/dx at fixed tau_b) / sigma
//   M = I + h' [0 1] (readout/rows) / (1 - k)
#pragma once

#include <memory>

#include <ceres/sized_cost_function.h>

#include "core/camera.h"
#include "estimator/factors/local_motion.h"
#include "estimator/factors/parameter_blocks.h"

namespace plumbline::estimator {

// A frame as the factors see it.
struct FrameTiming {
  std::shared_ptr<const LocalMotion> motion;  // about the instant of the frame's state
  double offset_s = 0.0;                      // t_cam,k - s_k
};

struct CameraModel {
  core::PinholeCamera camera;
  double pixel_sigma_px = 1.0;
  double gravity_m_s2 = 9.81;
};

// Blocks: anchor state, observer state, extrinsics, td, readout, landmark. False (Ceres rejects the step) where the
// landmark is not in front of the observer, or a time leaves the range of the local motion.
class PropagatedPointFactor final
    : public ceres::SizedCostFunction<2, kStateSize, kStateSize, kPoseSize, 1, 1, kLandmarkSize> {
 public:
  PropagatedPointFactor(const CameraModel& model, FrameTiming anchor, FrameTiming observer,
                        const Eigen::Vector2d& observed_pixel)
      : model_(model), anchor_(std::move(anchor)), observer_(std::move(observer)), observed_pixel_(observed_pixel) {}

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override;

 private:
  CameraModel model_;
  FrameTiming anchor_;
  FrameTiming observer_;
  Eigen::Vector2d observed_pixel_;
};

// The anchor's own observation: r = (project(x, y, 1) - z) / sigma_px. Block: landmark.
class AnchorPointFactor final : public ceres::SizedCostFunction<2, kLandmarkSize> {
 public:
  AnchorPointFactor(const CameraModel& model, const Eigen::Vector2d& observed_pixel)
      : model_(model), observed_pixel_(observed_pixel) {}

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override;

 private:
  CameraModel model_;
  Eigen::Vector2d observed_pixel_;
};

// The body at a time near a state: T_W_B(tau) and its rates.
struct TimedBody {
  LocalPose local;
  Eigen::Matrix3d R;         // R_W_B(tau)
  Eigen::Vector3d p;         // p_W_B(tau)
  Eigen::Vector3d velocity;  // dp/dtau
};
bool body_at(const LocalMotion& motion, const core::State& state, double gravity_m_s2, double tau_s, TimedBody& body,
             LocalPoseJacobians* jacobians = nullptr);

}  // namespace plumbline::estimator
