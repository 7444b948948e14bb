// How states and calibration lie in the parameter blocks of Ceres.
//   state      16 doubles  [ p_W_B | q_W_B (x y z w) | v_W | b_g | b_a ]     15 dof, tangent order of core/state.h
//   extrinsics  7 doubles  [ p_B_C | q_B_C (x y z w) ]                       6 dof  [ p | theta ]
//   td, readout  1 double each [s], landmark 3 doubles (x, y, lambda), intrinsics 4 doubles (fx, fy, cx, cy) [px]
#pragma once

#include <memory>

#include <Eigen/Core>
#include <ceres/product_manifold.h>

#include "core/calibration.h"
#include "core/so3_manifold.h"
#include "core/state.h"

namespace plumbline::estimator {

inline constexpr int kStateSize = 16;
inline constexpr int kPoseSize = 7;
inline constexpr int kLandmarkSize = 3;
inline constexpr int kIntrinsicsSize = 4;

using StateBlock = Eigen::Matrix<double, kStateSize, 1>;
using PoseBlock = Eigen::Matrix<double, kPoseSize, 1>;

inline core::Pose unpack_pose(const double* x) {
  return {Eigen::Quaterniond(Eigen::Map<const Eigen::Quaterniond>(x + 3)), Eigen::Map<const Eigen::Vector3d>(x)};
}

inline core::State unpack_state(const double* x) {
  return {.T_W_B = unpack_pose(x),
          .v_W = Eigen::Map<const Eigen::Vector3d>(x + 7),
          .bias = {Eigen::Map<const Eigen::Vector3d>(x + 10), Eigen::Map<const Eigen::Vector3d>(x + 13)}};
}

inline PoseBlock pack(const core::Pose& T) {
  PoseBlock x;
  x << T.p, T.q.coeffs();
  return x;
}

inline StateBlock pack(const core::State& s) {
  StateBlock x;
  x << s.T_W_B.p, s.T_W_B.q.coeffs(), s.v_W, s.bias.gyro_rad_s, s.bias.accel_m_s2;
  return x;
}

using PoseManifold = ceres::ProductManifold<ceres::EuclideanManifold<3>, core::So3Manifold>;
using StateManifold =
    ceres::ProductManifold<ceres::EuclideanManifold<3>, core::So3Manifold, ceres::EuclideanManifold<9>>;

// A Jacobian with respect to the tangent space, as Ceres wants it: with respect to the ambient space, so that the
// product with the manifold's PlusJacobian gives the tangent one again.
template <class TangentJacobian, class AmbientJacobian>
void lift_state_jacobian(const Eigen::MatrixBase<TangentJacobian>& J, const Eigen::Quaterniond& q,
                         Eigen::MatrixBase<AmbientJacobian>& ambient) {
  ambient.template leftCols<3>() = J.template leftCols<3>();
  ambient.template middleCols<4>(3) = J.template middleCols<3>(3) * core::minus_jacobian(q);
  if constexpr (AmbientJacobian::ColsAtCompileTime == kStateSize) {
    ambient.template rightCols<9>() = J.template rightCols<9>();
  }
}

}  // namespace plumbline::estimator
