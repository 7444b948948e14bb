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
    Eigen::Matrix<double, 9, 6> G;
    G.block<3, 3>(kOrientation, 0) = -step.Jr_dt;
    G.block<3, 3>(kVelocity, 0) = dt * step.half1 * step.Jr_dt;
    G.block<3, 3>(kPosition, 0) = 0.5 * dt * G.block<3, 3>(kVelocity, 0);
    G.block<3, 3>(kOrientation, 3).setZero();
    G.block<3, 3>(kVelocity, 3) = -dt * step.mean_R;
    G.block<3, 3>(kPosition, 3) = 0.5 * dt * G.block<3, 3>(kVelocity, 3);
    Eigen::Matrix<double, 6, 1> variance;
    variance << Eigen::Vector3d::Constant(gyro2 / dt), Eigen::Vector3d::Constant(accel2 / dt);
    P.topLeftCorner<9, 9>() += G * variance.asDiagonal() * G.transpose();
    P.diagonal().segment<3>(kGyroBias).array() += gyro_walk2 * dt;
    P.diagonal().segment<3>(kAccelBias).array() += accel_walk2 * dt;
  }
  P = 0.5 * (P + P.transpose()).eval();
  result.sqrt_information.setIdentity();
  P.llt().matrixL().solveInPlace(result.sqrt_information);
  return result;
}

}  // namespace plumbline::estimator
