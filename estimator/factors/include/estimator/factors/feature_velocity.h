// Point observations with camera timing `feature_velocity`: time offset and rolling shutter by the image velocity.
// Qin, Shen, "Online temporal calibration for monocular visual-inertial systems", IROS 2018, eq. 5 to 8, and the
// rolling shutter of VINS-Mono. The observation of row v is carried to the instant of its frame's state,
//   p(td, readout) = p - a v_p,   a = td - td_k + (v - rows/2)/rows * readout,   td_k = s_k - t_cam,k
// on the normalised plane, v_p its velocity (1/s), v the measured row, td_k the td with which the state's time was
// formed. Both bodies of the chain of point_chain.h are the states themselves.
//   r = h(q) - h(p_j(td, readout)),  h of ray_chart.h      dr/dtd = h'(p_j) (v_j, 0) - (dr/db) v_i
// where the last term is that of `fixed_bearing`, whose b = p_i(td, readout); with `bearing_inverse_depth` b is the
// bearing at the instant of the anchor's state, and the anchor's own observation is compared with it.
//
// Known defect: where the velocity is a difference of the same noisy pixels, the noise of p - a v_p depends on a and
// is least halfway to the other frame, which is where td is pulled (docs/experiments.md, velocity_model_bias).
#pragma once

#include <ceres/sized_cost_function.h>

#include "estimator/factors/point_factors.h"

namespace plumbline::estimator {

// An observed bearing that moves on the normalised plane.
class MovingBearing {
 public:
  MovingBearing() = default;
  MovingBearing(const core::PinholeCamera& camera, double offset_s, const Eigen::Vector2d& pixel,
                const Eigen::Vector2d& velocity)
      : p_(camera.unproject(pixel)),
        velocity_(velocity),
        offset_s_(offset_s),
        phase_(core::row_phase(pixel.y(), camera.height_px)) {}

  // (x, y, 1) at the instant of the frame's state.
  Eigen::Vector3d at(double td_s, double readout_s) const {
    Eigen::Vector3d p = p_;
    p.head<2>() -= (offset_s_ + td_s + phase_ * readout_s) * velocity_;
    return p;
  }
  const Eigen::Vector2d& velocity() const { return velocity_; }  // -d(x, y)/dtd
  double phase() const { return phase_; }                        // d/dreadout = phase d/dtd

 private:
  Eigen::Vector3d p_ = Eigen::Vector3d::UnitZ();
  Eigen::Vector2d velocity_ = Eigen::Vector2d::Zero();
  double offset_s_ = 0.0;
  double phase_ = 0.0;
};

// Blocks: anchor state, observer state, extrinsics, td, readout, landmark. False where the landmark, or the shifted
// observation, is not in front of the observer.
template <LandmarkType kLandmark>
class FeatureVelocityPoint final
    : public ceres::SizedCostFunction<2, kStateSize, kStateSize, kPoseSize, 1, 1, landmark_size(kLandmark)> {
 public:
  FeatureVelocityPoint(const RayChart& chart, const MovingBearing& observed)
    requires(kLandmark == LandmarkType::kBearingInverseDepth)
      : chart_(chart), observed_(observed) {}

  FeatureVelocityPoint(const RayChart& chart, const MovingBearing& observed, const MovingBearing& anchor)
    requires(kLandmark == LandmarkType::kFixedBearing)
      : chart_(chart), observed_(observed), anchor_(anchor) {}

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override;

 private:
  RayChart chart_;  // of the observer
  MovingBearing observed_;
  MovingBearing anchor_;  // where it is taken as exact
};

extern template class FeatureVelocityPoint<LandmarkType::kBearingInverseDepth>;
extern template class FeatureVelocityPoint<LandmarkType::kFixedBearing>;

// The anchor's own observation of a landmark bearing_inverse_depth: r = h((x, y, 1)) - h(p_i(td, readout)).
// Blocks: td, readout, landmark.
class FeatureVelocityAnchor final : public ceres::SizedCostFunction<2, 1, 1, kLandmarkSize> {
 public:
  FeatureVelocityAnchor(const RayChart& chart, const MovingBearing& observed) : chart_(chart), observed_(observed) {}

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override;

 private:
  RayChart chart_;
  MovingBearing observed_;
};

}  // namespace plumbline::estimator
