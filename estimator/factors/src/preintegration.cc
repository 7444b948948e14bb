#include "estimator/factors/preintegration.h"

#include <stdexcept>

#include <Eigen/Cholesky>

#include "core/time.h"

namespace plumbline::estimator {
namespace {

using Eigen::Matrix3d;

// The covariance by 3 x 3 blocks, of the error (truth minus measured); the biases walk independently, so that theirs
// are multiples of I.
class Covariance {
 public:
  // One step with white noise of these variances an axis, and walks of the biases by these.
  void advance(const ImuStep& step, double gyro2, double accel2, double gyro_walk2, double accel_walk2) {
    const auto& [dt, dR_T, Jr, H, G, M] = step;
    const double h = 0.5 * dt * dt;
    const double g2 = gyro_bias_ + gyro2;  // the noise of the samples is one more bias, for this step only
    const double a2 = accel_bias_ + accel2;

    // Covariances of a and of theta' with all that there was before the step.
    const Matrix3d a_p = -H * p_theta_.transpose() + G * p_bg_.transpose() - M * p_ba_.transpose();
    const Matrix3d a_v = -H * v_theta_.transpose() + G * v_bg_.transpose() - M * v_ba_.transpose();
    const Matrix3d a_theta = -H * theta_ + G * theta_bg_.transpose();
    const Matrix3d H_theta_bg = H * theta_bg_;
    const Matrix3d theta_p = dR_T * p_theta_.transpose() - Jr * p_bg_.transpose();
    const Matrix3d theta_v = dR_T * v_theta_.transpose() - Jr * v_bg_.transpose();
    const Matrix3d theta_theta = dR_T * theta_ - Jr * theta_bg_.transpose();
    const Matrix3d dR_theta_bg = dR_T * theta_bg_;

    // And with each other.
    const Matrix3d a_a = -a_theta * H.transpose() + (g2 * G - H_theta_bg) * G.transpose() + (a2 * M) * M.transpose();
    const Matrix3d theta_a = -theta_theta * H.transpose() + (dR_theta_bg - g2 * Jr) * G.transpose();
    theta_ = theta_theta * dR_T.transpose() - (dR_theta_bg - g2 * Jr) * Jr.transpose();

    // theta, then p' = p + v dt + a dt^2/2 and v' = v + a dt.
    p_ +=
        dt * (p_v_ + p_v_.transpose() + dt * v_) + h * (a_p + a_p.transpose() + dt * (a_v + a_v.transpose()) + h * a_a);
    p_v_ += dt * (v_ + a_p.transpose() + dt * a_v.transpose()) + h * (a_v + dt * a_a);
    v_ += dt * (a_v + a_v.transpose() + dt * a_a);
    p_theta_ = (theta_p + dt * theta_v + h * theta_a).transpose();
    v_theta_ = (theta_v + dt * theta_a).transpose();
    const Matrix3d a_bg = gyro_bias_ * G - H_theta_bg;
    p_bg_ += dt * v_bg_ + h * a_bg;
    v_bg_ += dt * a_bg;
    theta_bg_ = dR_theta_bg - gyro_bias_ * Jr;
    p_ba_ += dt * v_ba_ - (h * accel_bias_) * M;
    v_ba_ -= (dt * accel_bias_) * M;
    gyro_bias_ += gyro_walk2;
    accel_bias_ += accel_walk2;
  }

  StateMatrix matrix() const {
    using namespace core;
    StateMatrix P = StateMatrix::Zero();
    const auto set = [&](int row, int column, const Matrix3d& block) {
      P.block<3, 3>(row, column) = block;
      P.block<3, 3>(column, row) = block.transpose();
    };
    set(kPosition, kPosition, 0.5 * (p_ + p_.transpose()));
    set(kOrientation, kOrientation, 0.5 * (theta_ + theta_.transpose()));
    set(kVelocity, kVelocity, 0.5 * (v_ + v_.transpose()));
    set(kPosition, kOrientation, p_theta_);
    set(kPosition, kVelocity, p_v_);
    set(kVelocity, kOrientation, v_theta_);
    set(kPosition, kGyroBias, p_bg_);
    set(kOrientation, kGyroBias, theta_bg_);
    set(kVelocity, kGyroBias, v_bg_);
    set(kPosition, kAccelBias, p_ba_);
    set(kVelocity, kAccelBias, v_ba_);
    P.diagonal().segment<3>(kGyroBias).setConstant(gyro_bias_);
    P.diagonal().segment<3>(kAccelBias).setConstant(accel_bias_);
    return P;
  }

 private:
  Matrix3d p_ = Matrix3d::Zero();
  Matrix3d p_v_ = Matrix3d::Zero();
  Matrix3d v_ = Matrix3d::Zero();
  Matrix3d theta_ = Matrix3d::Zero();
  Matrix3d p_theta_ = Matrix3d::Zero();
  Matrix3d v_theta_ = Matrix3d::Zero();
  Matrix3d p_bg_ = Matrix3d::Zero();
  Matrix3d v_bg_ = Matrix3d::Zero();
  Matrix3d theta_bg_ = Matrix3d::Zero();
  Matrix3d p_ba_ = Matrix3d::Zero();
  Matrix3d v_ba_ = Matrix3d::Zero();
  double gyro_bias_ = 0.0;
  double accel_bias_ = 0.0;
};

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
  Covariance covariance;
  for (std::size_t i = 0; i + 1 < samples.size(); ++i) {
    const double dt = core::to_seconds(samples[i + 1].t_ns - samples[i].t_ns);
    const ImuStep step = advance(samples[i], samples[i + 1], bias, dt, result.increment);
    covariance.advance(step, gyro2 / dt, accel2 / dt, gyro_walk2 * dt, accel_walk2 * dt);
    result.dt_s += dt;
  }
  result.covariance = covariance.matrix();
  result.sqrt_information.setIdentity();
  result.covariance.llt().matrixL().solveInPlace(result.sqrt_information);
  return result;
}

}  // namespace plumbline::estimator
