// The inertial sensor.
//   w_m = omega_B + b_g + n_g        a_m = R_W_B^T (a_W - g_W) + b_a + n_a
// n is white with standard deviation sigma/sqrt(dt); b walks by sigma_b sqrt(dt) from one sample to the next.
#pragma once

#include <vector>

#include "core/measurements.h"
#include "core/random.h"
#include "sim/trajectory.h"

namespace plumbline::sim {

struct ImuRecording {
  std::vector<core::ImuSample> samples;
  std::vector<core::ImuBias> biases;  // the truth at each sample
};

// Samples at 0, dt, 2 dt, ... up to duration_s.
ImuRecording simulate_imu(const Trajectory& trajectory, const ImuConfig& config, double gravity_m_s2, double duration_s,
                          core::TrialId id);

}  // namespace plumbline::sim
