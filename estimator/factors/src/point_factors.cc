#include "estimator/factors/point_factors.h"

#include "core/calibration.h"
#include "estimator/factors/point_jacobians.h"

namespace plumbline::estimator {

template <LandmarkType kLandmark>
struct PropagatedPoint<kLandmark>::Anchor {
  Eigen::Vector3d b;
  double lambda = 0.0;
  double phase = 0.0;                                         // of the row, in shares of the readout
  Eigen::RowVector2d dphase_db = Eigen::RowVector2d::Zero();  // with respect to (x, y)
};

template <LandmarkType kLandmark>
bool PropagatedPoint<kLandmark>::find_anchor(const double* landmark, Anchor& anchor) const {
  const int rows = camera_.height_px;
  if constexpr (kLandmark == LandmarkType::kFixedBearing) {
    anchor.b = fixed_.bearing;
    anchor.lambda = landmark[0];
    anchor.phase = core::row_phase(fixed_.row, rows);
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
bool PropagatedPoint<kLandmark>::Evaluate(double const* const* parameters, double* residuals,
                                          double** jacobians) const {
  const core::State state_i = unpack_state(parameters[0]);
  const core::State state_j = unpack_state(parameters[1]);
  const core::Pose extrinsics = unpack_pose(parameters[2]);
  const RigidMotion T_B_C = rigid_motion(extrinsics);
  const double td_s = *parameters[3];
  const double readout_s = *parameters[4];
  const auto wanted = [&](int block) { return jacobians != nullptr && jacobians[block] != nullptr; };

  Anchor anchor;
  if (!find_anchor(parameters[5], anchor)) return false;
  const double tau_a_s = anchor_.offset_s + td_s + anchor.phase * readout_s;
  TimedBody body_a;
  BodyPath path_a(*anchor_.motion, state_i, gravity_m_s2_);
  if (!path_a.at(tau_a_s, body_a)) return false;
  PointChain chain(anchor.b, anchor.lambda);
  chain.to_world(T_B_C, body_a);

  RollingView observer;
  BodyPath path_b(*observer_.motion, state_j, gravity_m_s2_);
  const RollingShutter shutter{observer_.offset_s + td_s, readout_s};
  if (!view_point(camera_, shutter, T_B_C, measured_row_, path_b, chain, observer)) return false;

  Eigen::Vector2d h;
  Matrix23 dr_dq;
  if (!chart_.at(chain.q, h, jacobians != nullptr ? &dr_dq : nullptr)) return false;
  Eigen::Map<Eigen::Vector2d> r(residuals);
  r = h - chart_.observed();
  if (jacobians == nullptr) return true;

  const PointChainJacobians J(observer.with_row(dr_dq), T_B_C, body_a, observer.body);
  const Eigen::Vector2d anchor_flow =
      J.W * (body_a.R * body_a.local.omega.cross(chain.B) + chain.lambda * body_a.velocity);
  const Eigen::Vector2d observer_flow = J.q * observer.q_dot;

  if (wanted(0)) {
    write_state(path_a.chain_to_state<2>(body_a, J.anchor_position(chain), J.anchor_rotation(chain)), state_i.T_W_B.q,
                jacobians[0]);
  }
  if (wanted(1)) {
    write_state(path_b.chain_to_state<2>(observer.body, J.observer_position(chain), J.observer_rotation(chain)),
                state_j.T_W_B.q, jacobians[1]);
  }
  if (wanted(2)) write_pose(J.extrinsic_position(chain), J.extrinsic_rotation(chain), extrinsics.q, jacobians[2]);
  if (wanted(3)) write_scalar(anchor_flow + observer_flow, jacobians[3]);
  if (wanted(4)) write_scalar(anchor.phase * anchor_flow + observer.phase * observer_flow, jacobians[4]);
  if (wanted(5)) {
    write_landmark<kLandmark>(J.b.template leftCols<2>() + readout_s * anchor_flow * anchor.dphase_db,
                              J.inverse_depth(T_B_C, body_a, observer.body), jacobians[5]);
  }
  return true;
}

template class PropagatedPoint<LandmarkType::kBearingInverseDepth>;
template class PropagatedPoint<LandmarkType::kFixedBearing>;

bool AnchorPointFactor::Evaluate(double const* const* parameters, double* residuals, double** jacobians) const {
  Eigen::Vector2d h;
  Matrix23 J;
  if (!chart_.at({parameters[0][0], parameters[0][1], 1.0}, h, &J)) return false;
  Eigen::Map<Eigen::Vector2d> r(residuals);
  r = h - chart_.observed();
  if (jacobians != nullptr && jacobians[0] != nullptr) {
    write_landmark<LandmarkType::kBearingInverseDepth>(J.leftCols<2>(), Eigen::Vector2d::Zero(), jacobians[0]);
  }
  return true;
}

}  // namespace plumbline::estimator
