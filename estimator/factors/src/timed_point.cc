#include "estimator/factors/timed_point.h"

#include "core/calibration.h"
#include "estimator/factors/point_jacobians.h"
#include "estimator/factors/spline_path.h"

namespace plumbline::estimator {

template <LandmarkType kLandmark>
struct TimedPoint<kLandmark>::Anchor {
  Eigen::Vector3d b;
  double lambda = 0.0;
  double phase = 0.0;                                         // of the row, in shares of the readout
  Eigen::RowVector2d dphase_db = Eigen::RowVector2d::Zero();  // with respect to (x, y)
};

template <LandmarkType kLandmark>
bool TimedPoint<kLandmark>::find_anchor(const double* landmark, Anchor& anchor) const {
  const int rows = camera_.height_px;
  if constexpr (kLandmark == LandmarkType::kFixedBearing) {
    anchor.b = fixed_bearing_;
    anchor.lambda = landmark[0];
    anchor.phase = core::row_phase(fixed_row_px_, rows);
  } else {
    anchor.b = {landmark[0], landmark[1], 1.0};
    anchor.lambda = landmark[2];
    Matrix23 J;
    const auto pixel = camera_.project(anchor.b, &J);
    if (!pixel) return false;
    anchor.phase = core::row_phase(pixel->y(), rows);
    anchor.dphase_db = J.row(1).template head<2>() / rows;
  }
  return true;
}

template <LandmarkType kLandmark>
template <class Path>
bool TimedPoint<kLandmark>::see(const TimedRig& rig, const double* landmark, Path& anchor_path, double anchor_offset_s,
                                Path& observer_path, double observer_offset_s, Eigen::Vector2d& residual,
                                TimedPointJacobians* jacobians) const {
  Anchor anchor;
  if (!find_anchor(landmark, anchor)) return false;
  TimedBody body_a;
  if (!anchor_path.at(anchor_offset_s + rig.td_s + anchor.phase * rig.readout_s, body_a)) return false;
  PointChain chain(anchor.b, anchor.lambda);
  chain.to_world(rig.T_B_C, body_a);

  RollingView observer;
  const RollingShutter shutter{observer_offset_s + rig.td_s, rig.readout_s};
  if (!view_point(camera_, shutter, rig.T_B_C, measured_row_, observer_path, chain, observer)) return false;

  Eigen::Vector2d h;
  Matrix23 dr_dq;
  if (!chart_.at(chain.q, h, jacobians != nullptr ? &dr_dq : nullptr)) return false;
  residual = h - chart_.observed();
  if (jacobians == nullptr) return true;

  const PointChainJacobians J(observer.with_row(dr_dq), rig.T_B_C, body_a, observer.body);
  const Eigen::Vector2d anchor_flow = J.W * (body_a.R * body_a.omega.cross(chain.B) + chain.lambda * body_a.velocity);
  const Eigen::Vector2d observer_flow = J.q * observer.q_dot;
  *jacobians = {.anchor_position = J.anchor_position(chain),
                .anchor_rotation = J.anchor_rotation(chain),
                .observer_position = J.observer_position(chain),
                .observer_rotation = J.observer_rotation(chain),
                .extrinsic_position = J.extrinsic_position(chain),
                .extrinsic_rotation = J.extrinsic_rotation(chain),
                .td = anchor_flow + observer_flow,
                .readout = anchor.phase * anchor_flow + observer.phase * observer_flow,
                .xy = J.b.template leftCols<2>() + rig.readout_s * anchor_flow * anchor.dphase_db,
                .lambda = J.inverse_depth(rig.T_B_C, body_a, observer.body)};
  return true;
}

template <LandmarkType kLandmark>
void TimedPoint<kLandmark>::write_shared(const TimedPointJacobians& J, const TimedRig& rig, double** jacobians) {
  if (jacobians[0] != nullptr) write_pose(J.extrinsic_position, J.extrinsic_rotation, rig.extrinsics.q, jacobians[0]);
  if (jacobians[1] != nullptr) write_scalar(J.td, jacobians[1]);
  if (jacobians[2] != nullptr) write_scalar(J.readout, jacobians[2]);
  if (jacobians[3] != nullptr) write_landmark<kLandmark>(J.xy, J.lambda, jacobians[3]);
}

template class TimedPoint<LandmarkType::kBearingInverseDepth>;
template class TimedPoint<LandmarkType::kFixedBearing>;
template bool TimedPoint<LandmarkType::kBearingInverseDepth>::see(const TimedRig&, const double*, BodyPath&, double,
                                                                  BodyPath&, double, Eigen::Vector2d&,
                                                                  TimedPointJacobians*) const;
template bool TimedPoint<LandmarkType::kFixedBearing>::see(const TimedRig&, const double*, BodyPath&, double, BodyPath&,
                                                           double, Eigen::Vector2d&, TimedPointJacobians*) const;
template bool TimedPoint<LandmarkType::kBearingInverseDepth>::see(const TimedRig&, const double*, SplinePath&, double,
                                                                  SplinePath&, double, Eigen::Vector2d&,
                                                                  TimedPointJacobians*) const;
template bool TimedPoint<LandmarkType::kFixedBearing>::see(const TimedRig&, const double*, SplinePath&, double,
                                                           SplinePath&, double, Eigen::Vector2d&,
                                                           TimedPointJacobians*) const;

}  // namespace plumbline::estimator
