#include "estimator/factors/point_factors.h"

#include "estimator/factors/point_jacobians.h"

namespace plumbline::estimator {

template <LandmarkType kLandmark>
bool PropagatedPoint<kLandmark>::Evaluate(double const* const* parameters, double* residuals,
                                          double** jacobians) const {
  const core::State state_i = unpack_state(parameters[0]);
  const core::State state_j = unpack_state(parameters[1]);
  const TimedRig rig(parameters + 2);
  BodyPath path_i(*anchor_.motion, state_i, gravity_m_s2_);
  BodyPath path_j(*observer_.motion, state_j, gravity_m_s2_);
  Eigen::Vector2d r;
  TimedPointJacobians J;
  if (!law_.see(rig, parameters[5], path_i, anchor_.offset_s, path_j, observer_.offset_s, r,
                jacobians != nullptr ? &J : nullptr)) {
    return false;
  }
  Eigen::Map<Eigen::Vector2d>{residuals} = r;
  if (jacobians == nullptr) return true;
  if (jacobians[0] != nullptr) {
    write_state(path_i.chain_to_state<2>(J.anchor_position, J.anchor_rotation), state_i.T_W_B.q, jacobians[0]);
  }
  if (jacobians[1] != nullptr) {
    write_state(path_j.chain_to_state<2>(J.observer_position, J.observer_rotation), state_j.T_W_B.q, jacobians[1]);
  }
  law_.write_shared(J, rig, jacobians + 2);
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
