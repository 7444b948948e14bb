// Inertial measurements between two states, summed up once (Forster, Carlone, Dellaert, Scaramuzza, "On-manifold
// preintegration for real-time visual-inertial odometry", TRO 2017; Qin, Li, Shen, "VINS-Mono", TRO 2018).
//
// The residual of the factor (imu_factor.h) at the true states has the covariance computed here, order of
// core/state.h: [ p (body frame of the first state) | theta | v | b_g | b_a ]. A step carries one white noise of
// variance sigma^2/dt an axis and sensor, and the biases walk by sigma_b^2 dt, also within the interval: hence the
// correlation between the increments and the change of bias.
#pragma once

#include <span>

#include <Eigen/Core>

#include "core/calibration.h"
#include "core/measurements.h"
#include "core/state.h"
#include "estimator/factors/imu_increment.h"

namespace plumbline::estimator {

using StateMatrix = Eigen::Matrix<double, core::kStateDof, core::kStateDof>;

struct Preintegration {
  double dt_s = 0.0;
  ImuIncrement increment;
  core::ImuBias bias;  // with which it was made; the factor corrects to first order
  StateMatrix covariance = StateMatrix::Zero();
  StateMatrix sqrt_information = StateMatrix::Zero();  // S^T S = covariance^-1
};

// samples.front() and samples.back() are at the two states. Needs two samples and positive noise densities, else
// std::invalid_argument.
Preintegration preintegrate(std::span<const core::ImuSample> samples, const core::ImuBias& bias,
                            const core::ImuNoise& noise);

}  // namespace plumbline::estimator
