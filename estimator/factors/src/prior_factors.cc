#include "estimator/factors/prior_factors.h"

namespace plumbline::estimator {
namespace {

// d Log((q Exp(d))^-1 q_mean)/d d = -Jl^-1(theta) = -Jr^-1(-theta), theta = Log(q^-1 q_mean).
Eigen::Matrix3d rotation_jacobian(const Eigen::Vector3d& theta) { return -core::right_jacobian_inverse(-theta); }

}  // namespace

bool StatePriorFactor::Evaluate(double const* const* parameters, double* residuals, double** jacobians) const {
  const core::State x = unpack_state(parameters[0]);
  const core::StateTangent difference = core::minus(mean_, x);
  Eigen::Map<core::StateTangent> r(residuals);
  r = difference.cwiseQuotient(sigma_);
  if (jacobians != nullptr && jacobians[0] != nullptr) {
    using Square = Eigen::Matrix<double, core::kStateDof, core::kStateDof>;
    Square J = -Square::Identity();
    J.block<3, 3>(core::kOrientation, core::kOrientation) =
        rotation_jacobian(difference.segment<3>(core::kOrientation));
    J = sigma_.cwiseInverse().asDiagonal() * J;
    Eigen::Map<Eigen::Matrix<double, core::kStateDof, kStateSize, Eigen::RowMajor>> ambient(jacobians[0]);
    lift_state_jacobian(J, x.T_W_B.q, ambient);
  }
  return true;
}

bool ExtrinsicsPriorFactor::Evaluate(double const* const* parameters, double* residuals, double** jacobians) const {
  const core::Pose x = unpack_pose(parameters[0]);
  const Eigen::Vector3d theta = core::log_so3(Eigen::Quaterniond(x.q.conjugate() * mean_.q));
  Eigen::Map<Eigen::Matrix<double, 6, 1>> r(residuals);
  r << (mean_.p - x.p) / position_sigma_m_, theta / rotation_sigma_rad_;
  if (jacobians != nullptr && jacobians[0] != nullptr) {
    Eigen::Matrix<double, 6, 6> J = Eigen::Matrix<double, 6, 6>::Zero();
    J.topLeftCorner<3, 3>() = -Eigen::Matrix3d::Identity() / position_sigma_m_;
    J.bottomRightCorner<3, 3>() = rotation_jacobian(theta) / rotation_sigma_rad_;
    Eigen::Map<Eigen::Matrix<double, 6, kPoseSize, Eigen::RowMajor>> ambient(jacobians[0]);
    lift_state_jacobian(J, x.q, ambient);
  }
  return true;
}

bool ScalarPriorFactor::Evaluate(double const* const* parameters, double* residuals, double** jacobians) const {
  residuals[0] = (mean_ - *parameters[0]) / sigma_;
  if (jacobians != nullptr && jacobians[0] != nullptr) jacobians[0][0] = -1.0 / sigma_;
  return true;
}

bool IntrinsicsPriorFactor::Evaluate(double const* const* parameters, double* residuals, double** jacobians) const {
  const Eigen::Map<const core::Intrinsics> K(parameters[0]);
  Eigen::Map<core::Intrinsics> r(residuals);
  r = (mean_ - K).cwiseQuotient(sigma_);
  if (jacobians != nullptr && jacobians[0] != nullptr) {
    Eigen::Map<Eigen::Matrix4d> J(jacobians[0]);
    J = Eigen::Matrix4d((-sigma_.cwiseInverse()).asDiagonal());
  }
  return true;
}

}  // namespace plumbline::estimator
