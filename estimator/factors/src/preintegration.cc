#include "estimator/factors/preintegration.h"

#include <stdexcept>

#include <Eigen/Cholesky>

#include "core/time.h"

namespace plumbline::estimator {
namespace {

using core::kAccelBias;
using core::kGyroBias;
using core::kOrientation;
using core::kPosition;
using core::kVelocity;

// F X for the error (truth minus measured) of one step, block rows in the order of core/state.h:
//   theta' = Exp(-phi) theta - Jr dt b_g
//   a      = -R0 [f0]x/2 theta - R1 [f1]x/2 theta' - (R0 + R1)/2 b_a
//   v' = v + a dt,  p' = p + v dt + a dt^2/2
void apply_transition(const ImuStep& step, StateMatrix& X) {
  using Rows = Eigen::Matrix<double, 3, core::kStateDof>;
  const Rows theta = step.dR_T * X.middleRows<3>(kOrientation) - step.Jr_dt * X.middleRows<3>(kGyroBias);
  const Rows a =
      -step.half0 * X.middleRows<3>(kOrientation) - step.half1 * theta - step.mean_R * X.middleRows<3>(kAccelBias);
  X.middleRows<3>(kPosition) += step.dt * X.middleRows<3>(kVelocity) + 0.5 * step.dt * step.dt * a;
  X.middleRows<3>(kVelocity) += step.dt * a;
  X.middleRows<3>(kOrientation) = theta;
}

// v' and p' get dt a and dt^2/2 a, where a has the covariance a_cov and the orientation's noise theta_a_cov with it.
void add_noise_of_acceleration(double dt, const Eigen::Matrix3d& a_cov, const Eigen::Matrix3d& theta_a_cov,
                               StateMatrix& P) {
  const double to_v = dt;
  const double to_p = 0.5 * dt * dt;
  P.block<3, 3>(kVelocity, kVelocity) += to_v * to_v * a_cov;
  P.block<3, 3>(kPosition, kPosition) += to_p * to_p * a_cov;
  P.block<3, 3>(kPosition, kVelocity) += to_p * to_v * a_cov;
  P.block<3, 3>(kVelocity, kPosition) += to_p * to_v * a_cov;
  P.block<3, 3>(kOrientation, kVelocity) += to_v * theta_a_cov;
  P.block<3, 3>(kVelocity, kOrientation) += to_v * theta_a_cov.transpose();
  P.block<3, 3>(kOrientation, kPosition) += to_p * theta_a_cov;
  P.block<3, 3>(kPosition, kOrientation) += to_p * theta_a_cov.transpose();
}

}  // namespace

Preintegration preintegrate(std::span<const core::ImuSample> samples, const core::ImuBias& bias,
                            const core::ImuNoise& noise) {
  if (samples.size() < 2) throw std::invalid_argument("preintegrate: needs two samples");
  const double gyro2 = noise.gyro_noise_density * noise.gyro_noise_density;
  const double accel2 = noise.accel_noise_density * noise.accel_noise_density;
  const double gyro_walk2 = noise.gyro_bias_walk * noise.gyro_bias_walk;
  const double accel_walk2 = noise.accel_bias_walk * noise.accel_bias_walk;
  if (!(gyro2 > 0.0 && accel2 > 0.0 && gyro_walk2 > 0.0 && accel_walk2 > 0.0)) {
    throw std::invalid_argument("preintegrate: noise densities must be positive");
  }

  Preintegration result;
  result.bias = bias;
  StateMatrix& P = result.covariance;
  for (std::size_t i = 0; i + 1 < samples.size(); ++i) {
    const double dt = core::to_seconds(samples[i + 1].t_ns - samples[i].t_ns);
    const ImuStep step = advance(samples[i], samples[i + 1], bias, dt, result.increment);
    result.dt_s += dt;

    apply_transition(step, P);
    P.transposeInPlace();
    apply_transition(step, P);
    // One noise of variance sigma^2/dt a step: theta' gets -Jr dt n_g, a gets R1 [f1]x/2 Jr dt n_g - (R0 + R1)/2 n_a.
    const Eigen::Matrix3d a_ng = step.half1 * step.Jr_dt;
    const Eigen::Matrix3d a_cov =
        (gyro2 / dt) * (a_ng * a_ng.transpose()) + (accel2 / dt) * (step.mean_R * step.mean_R.transpose());
    const Eigen::Matrix3d theta_a_cov = (-gyro2 / dt) * (step.Jr_dt * a_ng.transpose());
    P.block<3, 3>(kOrientation, kOrientation) += (gyro2 / dt) * (step.Jr_dt * step.Jr_dt.transpose());
    add_noise_of_acceleration(dt, a_cov, theta_a_cov, P);
    P.diagonal().segment<3>(kGyroBias).array() += gyro_walk2 * dt;
    P.diagonal().segment<3>(kAccelBias).array() += accel_walk2 * dt;
  }
  P = 0.5 * (P + P.transpose()).eval();
  result.sqrt_information.setIdentity();
  P.llt().matrixL().solveInPlace(result.sqrt_information);
  return result;
}

}  // namespace plumbline::estimator
