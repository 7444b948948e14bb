// The batch problem of a short recording at its truth, for tests that hold the bound against it.
#pragma once

#include <cstdlib>
#include <vector>

#include "estimator/batch_problem.h"
#include "sim/simulate.h"

namespace plumbline::testing {

inline sim::ScenarioConfig bound_scenario(int points_per_frame) {
  sim::ScenarioConfig c;
  c.duration_s = 2.5;
  c.trajectory.handheld.rate_rms_rad_s = 0.75;
  c.imu.noise = {1.7e-4, 2e-5, 2e-3, 3e-3};
  c.camera.td_s = 0.02;
  c.camera.readout_s = 0.03;
  c.points.per_frame = points_per_frame;
  // A prior whose mean is off the truth has a Jacobian that is off the identity by half as much.
  c.prior.means = sim::PriorMeans::kTruth;
  return c;
}

inline std::vector<std::size_t> every_second_frame(const core::MeasurementLog& log) {
  std::vector<std::size_t> frames;
  for (std::size_t i = 0; i < log.frames.size(); i += 2) frames.push_back(i);
  return frames;
}

inline std::size_t nearest_sample(const core::MeasurementLog& log, core::TimeNs t_ns) {
  std::size_t best = 0;
  for (std::size_t i = 0; i < log.imu.size(); ++i) {
    if (std::abs(log.imu[i].t_ns - t_ns) < std::abs(log.imu[best].t_ns - t_ns)) best = i;
  }
  return best;
}

// Calibration and states; landmarks are the test's own.
inline estimator::BatchValues true_states(const estimator::BatchInput& input, const sim::GroundTruth& truth) {
  const core::MeasurementLog& log = input.log;
  estimator::BatchValues values;
  values.calibration = truth.calibration;
  values.samples.push_back(0);
  for (const std::size_t k : input.keyframes) {
    values.samples.push_back(nearest_sample(log, log.frames[k].t_cam_ns + core::to_ns(truth.calibration.td_s)));
  }
  for (const std::size_t s : values.samples) values.states.push_back(truth.states[s].state);
  return values;
}

}  // namespace plumbline::testing
