// Writes the Jacobians of a residual of two numbers where Ceres wants them: row-major, with respect to the ambient
// spaces of parameter_blocks.h.
#pragma once

#include <Eigen/Core>

#include "estimator/factors/landmark.h"
#include "estimator/factors/parameter_blocks.h"
#include "estimator/factors/ray_chart.h"

namespace plumbline::estimator {

inline void write_state(const Eigen::Matrix<double, 2, core::kStateDof>& J, const Eigen::Quaterniond& q, double* out) {
  Eigen::Map<Eigen::Matrix<double, 2, kStateSize, Eigen::RowMajor>> ambient(out);
  lift_state_jacobian(J, q, ambient);
}

inline void write_pose(const Matrix23& J_p, const Matrix23& J_theta, const Eigen::Quaterniond& q, double* out) {
  Eigen::Map<Eigen::Matrix<double, 2, kPoseSize, Eigen::RowMajor>> ambient(out);
  ambient.leftCols<3>() = J_p;
  ambient.rightCols<4>().noalias() = J_theta * core::minus_jacobian(q);
}

inline void write_scalar(const Eigen::Vector2d& J, double* out) {
  out[0] = J.x();
  out[1] = J.y();
}

// (x, y), where they are estimated, and lambda.
template <LandmarkType kLandmark>
void write_landmark(const Eigen::Matrix2d& J_xy, const Eigen::Vector2d& J_lambda, double* out) {
  if constexpr (kLandmark == LandmarkType::kFixedBearing) {
    write_scalar(J_lambda, out);
  } else {
    Eigen::Map<Eigen::Matrix<double, 2, kLandmarkSize, Eigen::RowMajor>> J(out);
    J << J_xy, J_lambda;
  }
}

}  // namespace plumbline::estimator
