#include "estimator/factors/anchored_point.h"

#include <stdexcept>
#include <utility>

#include "estimator/factors/point_jacobians.h"

namespace plumbline::estimator {

using Matrix2State = Eigen::Matrix<double, 2, core::kStateDof>;
using Matrix2Intrinsics = Eigen::Matrix<double, 2, kIntrinsicsSize>;

struct Sighting {
  Eigen::Vector2d residual;
  Matrix23 dr_dq;  // with the row's own motion
  RigidMotion T_W_Bj;
  Matrix2State state;  // of the observer
  Eigen::Vector2d td;
  Eigen::Vector2d readout;
  Matrix2Intrinsics intrinsics;  // where they are estimated
};

namespace {

// Of the chain from W to q, in the observer.
struct ObserverJacobians {
  ObserverJacobians(const Matrix23& dr_dq, const RigidMotion& T_B_C, const RigidMotion& T_W_Bj)
      : q(dr_dq), X(dr_dq * T_B_C.R.transpose()), W(X * T_W_Bj.R.transpose()) {}
  Matrix23 position(const PointChain& c) const { return -c.lambda * W; }
  Matrix23 rotation(const PointChain& c) const { return times_skew(X, c.X); }

  Matrix23 q;
  Matrix23 X;
  Matrix23 W;
};

// What Evaluate gives, on the tangent spaces.
struct AnchoredRows {
  Eigen::Vector2d residual;
  Matrix23 anchor_position;
  Matrix23 anchor_rotation;
  Matrix2State observer;
  Matrix23 extrinsic_position;
  Matrix23 extrinsic_rotation;
  Eigen::Vector2d td;
  Eigen::Vector2d readout;
  Eigen::Matrix2d xy;
  Eigen::Vector2d lambda;
  Matrix2Intrinsics intrinsics;
};

// shared: extrinsics, td, readout, landmark, intrinsics
template <class Sight>
bool evaluate(const Sight& sight, const RigidMotion& T_B_A, const core::Pose& T_W_Bi, const core::State& observer,
              double const* const* shared, bool differentiate, AnchoredRows& rows) {
  const RigidMotion anchor = rigid_motion(T_W_Bi);
  const RigidMotion T_B_C = rigid_motion(unpack_pose(shared[0]));
  const double* landmark = shared[3];
  const Viewpoint from{observer, T_B_C, *shared[1], *shared[2], Sight::kEstimatesCamera ? shared[4] : nullptr};
  PointChain chain({landmark[0], landmark[1], 1.0}, landmark[2]);
  chain.to_world(T_B_A, anchor);
  Sighting seen;
  if (!sight.see(from, chain, differentiate, seen)) return false;
  rows.residual = seen.residual;
  if (!differentiate) return true;
  const ObserverJacobians J(seen.dr_dq, T_B_C, seen.T_W_Bj);
  const Matrix23 J_B = J.W * anchor.R;
  rows.anchor_position = chain.lambda * J.W;
  rows.anchor_rotation = -times_skew(J_B, chain.B);
  rows.observer = seen.state;
  rows.extrinsic_position = -chain.lambda * J.X;
  rows.extrinsic_rotation = times_skew(J.q, chain.q);
  rows.td = seen.td;
  rows.readout = seen.readout;
  if constexpr (Sight::kEstimatesCamera) rows.intrinsics = seen.intrinsics;
  rows.xy = (J_B * T_B_A.R).template leftCols<2>();
  rows.lambda = J_B * T_B_A.p - J.X * T_B_C.p + J.W * (anchor.p - seen.T_W_Bj.p);
  return true;
}

template <class Sight>
void write_shared(const AnchoredRows& rows, double const* const* shared, double** jacobians) {
  if (jacobians[0] != nullptr) {
    write_pose(rows.extrinsic_position, rows.extrinsic_rotation, unpack_pose(shared[0]).q, jacobians[0]);
  }
  if (jacobians[1] != nullptr) write_scalar(rows.td, jacobians[1]);
  if (jacobians[2] != nullptr) write_scalar(rows.readout, jacobians[2]);
  if (jacobians[3] != nullptr) {
    write_landmark<LandmarkType::kBearingInverseDepth>(rows.xy, rows.lambda, jacobians[3]);
  }
  if constexpr (Sight::kEstimatesCamera) {
    if (jacobians[4] != nullptr) {
      Eigen::Map<Eigen::Matrix<double, 2, kIntrinsicsSize, Eigen::RowMajor>> ambient(jacobians[4]);
      ambient = rows.intrinsics;
    }
  }
}

}  // namespace

bool PropagatedSight::see(const Viewpoint& from, PointChain& chain, bool differentiate, Sighting& sighting) const {
  RollingView view;
  BodyPath path(*frame_.motion, from.state, gravity_m_s2_);
  const RollingShutter shutter{frame_.offset_s + from.td_s, from.readout_s};
  if (!view_point(camera_, shutter, from.T_B_C, measured_row_, path, chain, view)) return false;
  Eigen::Vector2d h;
  Matrix23 dr_dq;
  if (!chart_.at(chain.q, h, differentiate ? &dr_dq : nullptr)) return false;
  sighting.residual = h - chart_.observed();
  if (!differentiate) return true;
  sighting.dr_dq = view.with_row(dr_dq);
  sighting.T_W_Bj = view.body;
  const ObserverJacobians J(sighting.dr_dq, from.T_B_C, view.body);
  sighting.state = path.chain_to_state<2>(J.position(chain), J.rotation(chain));
  sighting.td = sighting.dr_dq * view.q_dot;
  sighting.readout = view.phase * sighting.td;
  return true;
}

FreeCameraSight::FreeCameraSight(const CameraModel& model, FrameTiming frame, const Eigen::Vector2d& observed_pixel)
    : model_(model), frame_(std::move(frame)), observed_pixel_(observed_pixel) {
  if (model.residual == ResidualType::kPinhole) return;
  throw std::invalid_argument("FreeCameraSight: the residual is not in pixels");
}

bool FreeCameraSight::see(const Viewpoint& from, PointChain& chain, bool differentiate, Sighting& sighting) const {
  const Eigen::Map<const core::Intrinsics> K(from.intrinsics);
  if (!(K[0] > 0.0 && K[1] > 0.0)) return false;
  CameraModel model = model_;
  model.camera = model_.camera.with(K);
  if (!PropagatedSight(model, frame_, observed_pixel_).see(from, chain, differentiate, sighting)) return false;
  if (!differentiate) return true;
  sighting.intrinsics = intrinsics_jacobian(model, observed_pixel_ + model.pixel_sigma_px * sighting.residual,
                                            from.readout_s, sighting.td);
  return true;
}

bool VelocitySight::see(const Viewpoint& from, PointChain& chain, bool differentiate, Sighting& sighting) const {
  sighting.T_W_Bj = rigid_motion(from.state.T_W_B);
  chain.to_camera(from.T_B_C, sighting.T_W_Bj);
  Eigen::Vector2d predicted;
  Eigen::Vector2d shifted;
  Matrix23 dh_dp;
  if (!chart_.at(chain.q, predicted, differentiate ? &sighting.dr_dq : nullptr)) return false;
  if (!chart_.at(observed_.at(from.td_s, from.readout_s), shifted, differentiate ? &dh_dp : nullptr)) return false;
  sighting.residual = predicted - shifted;
  if (!differentiate) return true;
  const ObserverJacobians J(sighting.dr_dq, from.T_B_C, sighting.T_W_Bj);
  sighting.state.setZero();  // velocity and biases
  sighting.state.middleCols<3>(core::kPosition) = J.position(chain);
  sighting.state.middleCols<3>(core::kOrientation) = J.rotation(chain);
  sighting.td = dh_dp.leftCols<2>() * observed_.velocity();
  sighting.readout = observed_.phase() * sighting.td;
  return true;
}

template <class Sight>
bool AnchoredPoint<Sight>::Evaluate(double const* const* parameters, double* residuals, double** jacobians) const {
  const core::Pose anchor = unpack_pose(parameters[0]);
  const core::State observer = unpack_state(parameters[1]);
  AnchoredRows rows;
  if (!evaluate(sight_, T_B_A_, anchor, observer, parameters + 2, jacobians != nullptr, rows)) return false;
  Eigen::Map<Eigen::Vector2d> r(residuals);
  r = rows.residual;
  if (jacobians == nullptr) return true;
  if (jacobians[0] != nullptr) {
    Eigen::Map<Eigen::Matrix<double, 2, kStateSize, Eigen::RowMajor>> ambient(jacobians[0]);
    ambient.setZero();  // velocity and biases
    ambient.leftCols<3>() = rows.anchor_position;
    ambient.middleCols<4>(3).noalias() = rows.anchor_rotation * core::minus_jacobian(anchor.q);
  }
  if (jacobians[1] != nullptr) write_state(rows.observer, observer.T_W_B.q, jacobians[1]);
  write_shared<Sight>(rows, parameters + 2, jacobians + 2);
  return true;
}

template <class Sight>
bool OwnAnchoredPoint<Sight>::Evaluate(double const* const* parameters, double* residuals, double** jacobians) const {
  const core::State state = unpack_state(parameters[0]);
  AnchoredRows rows;
  if (!evaluate(sight_, T_B_A_, state.T_W_B, state, parameters + 1, jacobians != nullptr, rows)) return false;
  Eigen::Map<Eigen::Vector2d> r(residuals);
  r = rows.residual;
  if (jacobians == nullptr) return true;
  if (jacobians[0] != nullptr) {
    rows.observer.template middleCols<3>(core::kPosition) += rows.anchor_position;
    rows.observer.template middleCols<3>(core::kOrientation) += rows.anchor_rotation;
    write_state(rows.observer, state.T_W_B.q, jacobians[0]);
  }
  write_shared<Sight>(rows, parameters + 1, jacobians + 1);
  return true;
}

template class AnchoredPoint<PropagatedSight>;
template class AnchoredPoint<FreeCameraSight>;
template class AnchoredPoint<VelocitySight>;
template class OwnAnchoredPoint<PropagatedSight>;
template class OwnAnchoredPoint<FreeCameraSight>;
template class OwnAnchoredPoint<VelocitySight>;

std::optional<AnchorChange> change_anchor(const Eigen::Vector3d& landmark, const core::Pose& T_W_A_old,
                                          const core::Pose& T_W_A_new) {
  constexpr double kLeastDepth = 1e-3;  // relative to the distance
  const RigidMotion from = rigid_motion(T_W_A_old);
  const RigidMotion to = rigid_motion(T_W_A_new);
  const double lambda = landmark.z();
  // Of the point, times lambda.
  const Eigen::Vector3d W = from.R * Eigen::Vector3d(landmark.x(), landmark.y(), 1.0) + lambda * from.p;
  const Eigen::Vector3d Q_new = to.R.transpose() * (W - lambda * to.p);
  if (!(Q_new.z() > kLeastDepth * Q_new.norm())) return std::nullopt;
  AnchorChange change;
  change.landmark = Eigen::Vector3d(Q_new.x(), Q_new.y(), lambda) / Q_new.z();

  // Back again: Q = R (x', y', 1) + lambda' t in the old camera, then (Q_x, Q_y, lambda') / Q_z. All lengths are times
  // lambda' here, so that Q_z = lambda'/lambda.
  const double lambda_new = change.landmark.z();
  const double z = 1.0 / Q_new.z();
  Eigen::Matrix3d df_dQ;  // (x, y, lambda) of the old camera
  df_dQ << 1.0, 0.0, -landmark.x(), 0.0, 1.0, -landmark.y(), 0.0, 0.0, -lambda;
  df_dQ /= z;
  const Eigen::Matrix3d R = from.R.transpose() * to.R;
  Eigen::Matrix3d dQ_dnew;
  dQ_dnew << R.leftCols<2>(), from.R.transpose() * (to.p - from.p);
  change.J_new.noalias() = df_dQ * dQ_dnew;
  change.J_new(2, 2) += 1.0 / z;
  const Eigen::Matrix3d J_W = df_dQ * from.R.transpose();
  change.J_relative << lambda_new * J_W, -times_skew(J_W, z * W);
  return change;
}

}  // namespace plumbline::estimator
