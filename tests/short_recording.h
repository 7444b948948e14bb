// A recording short enough that a batch estimate of it takes a fraction of a second, and how far an estimate is off.
#pragma once

#include <cmath>

#include "core/estimate.h"
#include "estimator/config.h"
#include "sim/ground_truth.h"
#include "sim/scenario.h"

namespace plumbline::testing {

inline const core::ImuNoise kEurocLike{1.7e-4, 2e-5, 2e-3, 3e-3};

inline sim::ScenarioConfig short_scenario(int points_per_frame) {
  sim::ScenarioConfig c;
  c.duration_s = 5.0;
  c.trajectory.handheld.rate_rms_rad_s = 0.75;
  c.camera.td_s = 0.02;
  c.camera.readout_s = 0.03;
  c.imu.noise = kEurocLike;
  c.world.landmarks = 2000;
  c.points.per_frame = points_per_frame;
  c.prior.td_sigma_s = 0.02;
  return c;
}

inline sim::ScenarioConfig noise_free(sim::ScenarioConfig c, double imu_rate_hz) {
  c.imu.rate_hz = imu_rate_hz;
  c.imu.noise = {};
  c.camera.pixel_sigma_px = 0.0;
  c.prior.means = sim::PriorMeans::kTruth;
  c.prior.start = sim::PriorStart::kDrawn;
  return c;
}

// The noise of points and of the ends of lines.
inline estimator::EstimatorConfig believing(const core::ImuNoise& noise, double sigma_px) {
  estimator::EstimatorConfig c;
  c.imu = {noise.gyro_noise_density, noise.gyro_bias_walk, noise.accel_noise_density, noise.accel_bias_walk};
  c.pixel_sigma_px = sigma_px;
  c.line_sigma_px = sigma_px;
  return c;
}

struct Errors {
  double td_s = 0.0;
  double readout_s = 0.0;
  double extrinsic_m = 0.0;
  double position_rms_m = 0.0;
};

inline Errors errors_of(const core::EstimateLog& estimate, const sim::GroundTruth& truth) {
  double sum = 0.0;
  for (const core::StampedState& s : estimate.states) {
    sum += (s.state.T_W_B.p - sim::state_at(truth, s.t_ns).T_W_B.p).squaredNorm();
  }
  return {estimate.calibration.td_s - truth.calibration.td_s,
          estimate.calibration.readout_s - truth.calibration.readout_s,
          (estimate.calibration.T_B_C.p - truth.calibration.T_B_C.p).norm(),
          std::sqrt(sum / static_cast<double>(estimate.states.size()))};
}

}  // namespace plumbline::testing
