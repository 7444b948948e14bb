#include "estimator/factors/imu_factor.h"

namespace plumbline::estimator {
namespace {

using core::kAccelBias;
using core::kGyroBias;
using core::kOrientation;
using core::kPosition;
using core::kVelocity;

// The increments at the bias of the state, to first order about the bias of the preintegration.
struct CorrectedIncrement {
  Eigen::Vector3d rotation_correction;  // dR/db_g d_bg
  Eigen::Quaterniond q;
  Eigen::Vector3d v;
  Eigen::Vector3d p;
};

CorrectedIncrement correct(const Preintegration& preintegration, const core::ImuBias& bias) {
  const ImuIncrement& x = preintegration.increment;
  const Eigen::Vector3d d_bg = bias.gyro_rad_s - preintegration.bias.gyro_rad_s;
  const Eigen::Vector3d d_ba = bias.accel_m_s2 - preintegration.bias.accel_m_s2;
  const Eigen::Vector3d correction = x.R_bg * d_bg;
  return {.rotation_correction = correction,
          .q = Eigen::Quaterniond(x.R) * core::exp_quaternion(correction),
          .v = x.v + x.v_bg * d_bg + x.v_ba * d_ba,
          .p = x.p + x.p_bg * d_bg + x.p_ba * d_ba};
}

}  // namespace

bool ImuFactor::Evaluate(double const* const* parameters, double* residuals, double** jacobians) const {
  const core::State i = unpack_state(parameters[0]);
  const core::State j = unpack_state(parameters[1]);
  const double dt = preintegration_.dt_s;
  const ImuIncrement& x = preintegration_.increment;
  const CorrectedIncrement increment = correct(preintegration_, i.bias);
  const Eigen::Matrix3d R_i_T = i.T_W_B.q.toRotationMatrix().transpose();

  const Eigen::Vector3d dp = R_i_T * (j.T_W_B.p - i.T_W_B.p - dt * i.v_W - 0.5 * dt * dt * gravity_W_);
  const Eigen::Vector3d dv = R_i_T * (j.v_W - i.v_W - dt * gravity_W_);
  core::StateTangent r;
  r.segment<3>(kPosition) = dp - increment.p;
  r.segment<3>(kOrientation) =
      core::log_so3(Eigen::Quaterniond(increment.q.conjugate() * i.T_W_B.q.conjugate() * j.T_W_B.q));
  r.segment<3>(kVelocity) = dv - increment.v;
  r.segment<3>(kGyroBias) = j.bias.gyro_rad_s - i.bias.gyro_rad_s;
  r.segment<3>(kAccelBias) = j.bias.accel_m_s2 - i.bias.accel_m_s2;
  Eigen::Map<core::StateTangent> whitened(residuals);
  const auto S = preintegration_.sqrt_information.triangularView<Eigen::Lower>();
  whitened = S * r;
  if (jacobians == nullptr) return true;

  const Eigen::Vector3d r_theta = r.segment<3>(kOrientation);
  const Eigen::Matrix3d Jr_inv = core::right_jacobian_inverse(r_theta);
  const Eigen::Matrix3d I = Eigen::Matrix3d::Identity();
  using Ambient = Eigen::Matrix<double, core::kStateDof, kStateSize, Eigen::RowMajor>;
  if (jacobians[0] != nullptr) {
    StateMatrix J = StateMatrix::Zero();
    J.block<3, 3>(kPosition, kPosition) = -R_i_T;
    J.block<3, 3>(kPosition, kOrientation) = core::skew(dp);
    J.block<3, 3>(kPosition, kVelocity) = -dt * R_i_T;
    J.block<3, 3>(kPosition, kGyroBias) = -x.p_bg;
    J.block<3, 3>(kPosition, kAccelBias) = -x.p_ba;
    J.block<3, 3>(kOrientation, kOrientation) = -Jr_inv * (j.T_W_B.q.conjugate() * i.T_W_B.q).toRotationMatrix();
    J.block<3, 3>(kOrientation, kGyroBias) =
        -Jr_inv * core::exp_so3(r_theta).transpose() * core::right_jacobian(increment.rotation_correction) * x.R_bg;
    J.block<3, 3>(kVelocity, kOrientation) = core::skew(dv);
    J.block<3, 3>(kVelocity, kVelocity) = -R_i_T;
    J.block<3, 3>(kVelocity, kGyroBias) = -x.v_bg;
    J.block<3, 3>(kVelocity, kAccelBias) = -x.v_ba;
    J.block<3, 3>(kGyroBias, kGyroBias) = -I;
    J.block<3, 3>(kAccelBias, kAccelBias) = -I;
    J = (S * J).eval();
    Eigen::Map<Ambient> ambient(jacobians[0]);
    lift_state_jacobian(J, i.T_W_B.q, ambient);
  }
  if (jacobians[1] != nullptr) {
    StateMatrix J = StateMatrix::Zero();
    J.block<3, 3>(kPosition, kPosition) = R_i_T;
    J.block<3, 3>(kOrientation, kOrientation) = Jr_inv;
    J.block<3, 3>(kVelocity, kVelocity) = R_i_T;
    J.block<3, 3>(kGyroBias, kGyroBias) = I;
    J.block<3, 3>(kAccelBias, kAccelBias) = I;
    J = (S * J).eval();
    Eigen::Map<Ambient> ambient(jacobians[1]);
    lift_state_jacobian(J, j.T_W_B.q, ambient);
  }
  return true;
}

}  // namespace plumbline::estimator
