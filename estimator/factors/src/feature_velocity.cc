#include "estimator/factors/feature_velocity.h"

#include "estimator/factors/point_jacobians.h"

namespace plumbline::estimator {

template <LandmarkType kLandmark>
bool FeatureVelocityPoint<kLandmark>::Evaluate(double const* const* parameters, double* residuals,
                                               double** jacobians) const {
  const core::Pose pose_i = unpack_pose(parameters[0]);
  const core::Pose pose_j = unpack_pose(parameters[1]);
  const core::Pose extrinsics = unpack_pose(parameters[2]);
  const RigidMotion T_W_Bi = rigid_motion(pose_i);
  const RigidMotion T_W_Bj = rigid_motion(pose_j);
  const RigidMotion T_B_C = rigid_motion(extrinsics);
  const double td_s = *parameters[3];
  const double readout_s = *parameters[4];
  const double* landmark = parameters[5];
  constexpr bool kFixed = kLandmark == LandmarkType::kFixedBearing;

  PointChain chain = [&] {
    if constexpr (kFixed) {
      return PointChain(anchor_.at(td_s, readout_s), landmark[0]);
    } else {
      return PointChain({landmark[0], landmark[1], 1.0}, landmark[2]);
    }
  }();
  chain.to_world(T_B_C, T_W_Bi);
  chain.to_camera(T_B_C, T_W_Bj);

  const bool differentiate = jacobians != nullptr;
  Eigen::Vector2d predicted;
  Eigen::Vector2d shifted;
  Matrix23 dr_dq;
  Matrix23 dh_dp;
  if (!chart_.at(chain.q, predicted, differentiate ? &dr_dq : nullptr)) return false;
  if (!chart_.at(observed_.at(td_s, readout_s), shifted, differentiate ? &dh_dp : nullptr)) return false;
  Eigen::Map<Eigen::Vector2d> r(residuals);
  r = predicted - shifted;
  if (!differentiate) return true;

  const PointChainJacobians J(dr_dq, T_B_C, T_W_Bi, T_W_Bj);
  const auto write_body = [](const Matrix23& J_p, const Matrix23& J_theta, const Eigen::Quaterniond& q, double* out) {
    Eigen::Map<Eigen::Matrix<double, 2, kStateSize, Eigen::RowMajor>> ambient(out);
    ambient.setZero();  // velocity and biases
    ambient.leftCols<3>() = J_p;
    ambient.middleCols<4>(3).noalias() = J_theta * core::minus_jacobian(q);
  };
  if (jacobians[0] != nullptr) write_body(J.anchor_position(chain), J.anchor_rotation(chain), pose_i.q, jacobians[0]);
  if (jacobians[1] != nullptr) {
    write_body(J.observer_position(chain), J.observer_rotation(chain), pose_j.q, jacobians[1]);
  }
  if (jacobians[2] != nullptr) {
    write_pose(J.extrinsic_position(chain), J.extrinsic_rotation(chain), extrinsics.q, jacobians[2]);
  }
  const Eigen::Vector2d observer_flow = dh_dp.leftCols<2>() * observed_.velocity();
  Eigen::Vector2d anchor_flow = Eigen::Vector2d::Zero();
  if constexpr (kFixed) anchor_flow = -J.b.template leftCols<2>() * anchor_.velocity();
  if (jacobians[3] != nullptr) write_scalar(anchor_flow + observer_flow, jacobians[3]);
  if (jacobians[4] != nullptr) {
    write_scalar(anchor_.phase() * anchor_flow + observed_.phase() * observer_flow, jacobians[4]);
  }
  if (jacobians[5] != nullptr) {
    write_landmark<kLandmark>(J.b.template leftCols<2>(), J.inverse_depth(T_B_C, T_W_Bi, T_W_Bj), jacobians[5]);
  }
  return true;
}

template class FeatureVelocityPoint<LandmarkType::kBearingInverseDepth>;
template class FeatureVelocityPoint<LandmarkType::kFixedBearing>;

bool FeatureVelocityAnchor::Evaluate(double const* const* parameters, double* residuals, double** jacobians) const {
  const double td_s = *parameters[0];
  const double readout_s = *parameters[1];
  Eigen::Vector2d estimated;
  Eigen::Vector2d shifted;
  Matrix23 J;
  Matrix23 dh_dp;
  if (!chart_.at({parameters[2][0], parameters[2][1], 1.0}, estimated, &J)) return false;
  if (!chart_.at(observed_.at(td_s, readout_s), shifted, &dh_dp)) return false;
  Eigen::Map<Eigen::Vector2d> r(residuals);
  r = estimated - shifted;
  if (jacobians == nullptr) return true;
  const Eigen::Vector2d flow = dh_dp.leftCols<2>() * observed_.velocity();
  if (jacobians[0] != nullptr) write_scalar(flow, jacobians[0]);
  if (jacobians[1] != nullptr) write_scalar(observed_.phase() * flow, jacobians[1]);
  if (jacobians[2] != nullptr) {
    write_landmark<LandmarkType::kBearingInverseDepth>(J.leftCols<2>(), Eigen::Vector2d::Zero(), jacobians[2]);
  }
  return true;
}

}  // namespace plumbline::estimator
