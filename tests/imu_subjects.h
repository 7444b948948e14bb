// The inertial factor as a subject of the laws.
#pragma once

#include <cmath>
#include <cstdint>
#include <vector>

#include "core/measurements.h"
#include "core/random.h"
#include "core/time.h"
#include "estimator/factors/imu_factor.h"
#include "estimator/factors/preintegration.h"
#include "factor_subject.h"
#include "plain_factors.h"
#include "rig_blocks.h"

namespace plumbline::testing {

inline const core::ImuNoise kImuNoise{1.7e-4, 2e-5, 2e-3, 3e-3};

// Lively samples about rest: rates of 1 rad/s, accelerations of 2 m/s^2.
inline std::vector<core::ImuSample> random_samples(int count, double dt_s, std::uint64_t seed) {
  std::vector<core::ImuSample> samples;
  for (int k = 0; k < count; ++k) {
    const double t = k * dt_s;
    const Eigen::Vector3d phase = kStateRandom.normal3(1000 + seed, 0);
    const Eigen::Vector3d gyro = (phase.array() + 3.0 * t * Eigen::Array3d(1.0, 1.3, 0.7)).sin();
    const Eigen::Vector3d accel = 2.0 * (phase.array() - 2.0 * t * Eigen::Array3d(0.8, 1.1, 1.7)).cos();
    samples.push_back({core::to_ns(t), gyro, accel + Eigen::Vector3d(0.0, 0.0, kGravity)});
  }
  return samples;
}

inline std::vector<core::ImuSample> samples_at_rest(int count, double dt_s) {
  std::vector<core::ImuSample> samples;
  for (int k = 0; k < count; ++k) samples.push_back({core::to_ns(k * dt_s), {0, 0, 0}, {0, 0, kGravity}});
  return samples;
}

inline FactorScene imu_scene(const std::vector<core::ImuSample>& samples, const core::ImuBias& bias,
                             const core::State& from, const core::State& to) {
  const estimator::Preintegration z = estimator::preintegrate(samples, bias, kImuNoise);
  return {std::make_unique<estimator::ImuFactor>(z, kGravity),
          automatic<PlainImuResidual, core::kStateDof, estimator::kStateSize, estimator::kStateSize>({z, kGravity}),
          {state_block(from, 0.02), state_block(to, 0.02)}};
}

// Samples that carry the state's own biases, white noise and a walk of the biases; the true end is where the samples
// without noise carry the state.
inline FactorScene imu_scene(const SceneRequest& request) {
  constexpr double kDt = 0.005;
  const core::State from = random_state(2 * request.scene);
  std::vector<core::ImuSample> samples = random_samples(41, kDt, request.scene);
  for (core::ImuSample& s : samples) {
    s.gyro_rad_s += from.bias.gyro_rad_s;
    s.accel_m_s2 += from.bias.accel_m_s2;
  }
  core::State to = estimator::carry(from, samples, 0, samples.size() - 1, kGravity);
  const core::RandomStream noise({11, request.draw}, "noise");
  const double white = request.noise / std::sqrt(kDt);
  const double step = request.noise * std::sqrt(kDt);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const core::ImuBias walked{to.bias.gyro_rad_s - from.bias.gyro_rad_s, to.bias.accel_m_s2 - from.bias.accel_m_s2};
    samples[i].gyro_rad_s += walked.gyro_rad_s + kImuNoise.gyro_noise_density * white * noise.normal3(i, 0);
    samples[i].accel_m_s2 += walked.accel_m_s2 + kImuNoise.accel_noise_density * white * noise.normal3(i, 1);
    if (i + 1 == samples.size()) break;
    to.bias.gyro_rad_s += kImuNoise.gyro_bias_walk * step * noise.normal3(i, 2);
    to.bias.accel_m_s2 += kImuNoise.accel_bias_walk * step * noise.normal3(i, 3);
  }
  FactorScene s = imu_scene(samples, from.bias, from, to);
  for (std::uint64_t k : {0U, 1U}) {
    if (request.off_truth) displace(s.blocks[k], 0.1, kStateRandom, 300 + request.scene, k);
    move_state(request.T_new_W, s.blocks[k]);
  }
  return s;
}

inline std::vector<FactorScene> imu_limits() {
  const std::vector<core::ImuSample> rest = samples_at_rest(21, 0.005);
  core::State turned;
  turned.T_W_B.q = core::exp_quaternion(Eigen::Vector3d(1.8, -1.8, 1.5));  // 2.96 rad off what was integrated
  std::vector<FactorScene> limits;
  limits.push_back(imu_scene(rest, {}, core::State{}, core::State{}));
  limits.push_back(imu_scene(rest, {}, core::State{}, turned));
  return limits;
}

inline std::vector<FactorSubject> imu_subjects() {
  // Rounding, whitened by 1e5. Both ends of a midpoint step share its noise, so that the sum holds N - 1/2 noises of N:
  // -1.25 %.
  return {{.name = "Imu",
           .scene = [](const SceneRequest& r) { return imu_scene(r); },
           .limits = imu_limits,
           .zero_tolerance = 1e-7,
           .whitening_slack = 0.0125}};
}

}  // namespace plumbline::testing
