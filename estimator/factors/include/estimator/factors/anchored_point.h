// Point observations of a landmark that is tied to a state: (x, y, lambda) in a camera that the anchor state i carries,
//   W = R_i (R_a b + lambda t_a) + lambda p_i,   b = (x, y, 1),   (R_a, t_a) = T_B_A constant
// T_B_A is the extrinsics as they were believed when the landmark got its value, so that lambda is an inverse depth; it
// is not estimated. From W on the chain is that of point_chain.h with the extrinsics as they are estimated:
//   X = R_j^T (W - lambda p_j),   q = R_c^T (X - lambda t_c)
// The anchor is the state at its own instant, whatever td, readout and extrinsics are, which the landmark therefore
// does not move with: it can outlive its anchor's observation, change to another anchor (change_anchor), and does not
// change at all where the whole world is moved or turned. Every observation, the anchor's own frame's too, is a
// residual.
//   `propagated`         r = h(q) - h(observed),      body j when the predicted row is exposed (rolling_view.h)
//                        with the camera's K = (fx, fy, cx, cy) estimated, pixels only: K moves the picture and,
//                        through the row v, the time; at a fixed time dv = (dv/dK) dK, so that
//                          dr/dK = (d(u, v)/dK)/sigma + (dr/dtd) (readout/rows) dv/dK
//   `feature_velocity`   r = h(q) - h(p_j(td, readout)),   body j the state itself (feature_velocity.h)
#pragma once

#include <optional>
#include <type_traits>

#include <ceres/sized_cost_function.h>

#include "estimator/factors/feature_velocity.h"
#include "estimator/factors/point_factors.h"

namespace plumbline::estimator {

// What the observer's half of the chain does with a point: the residual, and its derivatives.
struct Sighting;

// Where a look is made from.
struct Viewpoint {
  const core::State& state;
  const RigidMotion& T_B_C;
  double td_s = 0.0;
  double readout_s = 0.0;
  const double* intrinsics = nullptr;  // where the sight estimates them
};

// One frame's look at points; the two timing models.
class PropagatedSight {
 public:
  static constexpr bool kEstimatesCamera = false;

  PropagatedSight(const CameraModel& model, FrameTiming frame, const Eigen::Vector2d& observed_pixel)
      : camera_(model.camera),
        chart_(model.residual, model.camera, model.pixel_sigma_px, observed_pixel),
        gravity_m_s2_(model.gravity_m_s2),
        frame_(std::move(frame)),
        measured_row_(observed_pixel.y()) {}

  // W and lambda of the chain are given; sets X and q. False where Evaluate must be.
  bool see(const Viewpoint& from, PointChain& chain, bool differentiate, Sighting& sighting) const;

 private:
  core::PinholeCamera camera_;
  RayChart chart_;
  double gravity_m_s2_;
  FrameTiming frame_;
  double measured_row_;
};

// `propagated` with a camera whose intrinsics are estimated; those of the model do not count.
class FreeCameraSight {
 public:
  static constexpr bool kEstimatesCamera = true;

  // Throws std::invalid_argument where the residual is not in pixels: any other is whitened by the camera.
  FreeCameraSight(const CameraModel& model, FrameTiming frame, const Eigen::Vector2d& observed_pixel);

  bool see(const Viewpoint& from, PointChain& chain, bool differentiate, Sighting& sighting) const;

 private:
  CameraModel model_;
  FrameTiming frame_;
  Eigen::Vector2d observed_pixel_;
};

class VelocitySight {
 public:
  static constexpr bool kEstimatesCamera = false;

  VelocitySight(const RayChart& chart, const MovingBearing& observed) : chart_(chart), observed_(observed) {}

  bool see(const Viewpoint& from, PointChain& chain, bool differentiate, Sighting& sighting) const;

 private:
  RayChart chart_;
  MovingBearing observed_;
};

template <class Sight, int... kSizes>
using SightFactor = std::conditional_t<Sight::kEstimatesCamera, ceres::SizedCostFunction<2, kSizes..., kIntrinsicsSize>,
                                       ceres::SizedCostFunction<2, kSizes...>>;

// Blocks: anchor state, observer state, extrinsics, td, readout, landmark; and intrinsics where they are estimated.
template <class Sight>
class AnchoredPoint final : public SightFactor<Sight, kStateSize, kStateSize, kPoseSize, 1, 1, kLandmarkSize> {
 public:
  AnchoredPoint(Sight sight, const core::Pose& T_B_A) : sight_(std::move(sight)), T_B_A_(rigid_motion(T_B_A)) {}

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override;

 private:
  Sight sight_;
  RigidMotion T_B_A_;
};

// The same where the observer is the anchor. Blocks: state, extrinsics, td, readout, landmark; intrinsics.
template <class Sight>
class OwnAnchoredPoint final : public SightFactor<Sight, kStateSize, kPoseSize, 1, 1, kLandmarkSize> {
 public:
  OwnAnchoredPoint(Sight sight, const core::Pose& T_B_A) : sight_(std::move(sight)), T_B_A_(rigid_motion(T_B_A)) {}

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override;

 private:
  Sight sight_;
  RigidMotion T_B_A_;
};

extern template class AnchoredPoint<PropagatedSight>;
extern template class AnchoredPoint<FreeCameraSight>;
extern template class AnchoredPoint<VelocitySight>;
extern template class OwnAnchoredPoint<PropagatedSight>;
extern template class OwnAnchoredPoint<FreeCameraSight>;
extern template class OwnAnchoredPoint<VelocitySight>;

// A landmark seen from another anchor.
struct AnchorChange {
  Eigen::Vector3d landmark;  // (x, y, lambda) in the new anchor's camera
  // Of the landmark in the old anchor's camera, with respect to that in the new one's, and to
  // [ d_rho | d_phi ] of the new anchor less that of the old one, p' = Exp(phi) p + rho, R' = Exp(phi) R in the world.
  Eigen::Matrix3d J_new;
  Eigen::Matrix<double, 3, 6> J_relative;
};

// T_W_A: the cameras that the two anchors carry, T_W_B T_B_A. Nothing where the point is not in front of the new one.
std::optional<AnchorChange> change_anchor(const Eigen::Vector3d& landmark, const core::Pose& T_W_A_old,
                                          const core::Pose& T_W_A_new);

}  // namespace plumbline::estimator
