// The inertial sensor. With the true rate w = omega_B and specific force f = R_W_B^T (a_W - g_W) at the time of sample
// i:
//   w_m = Sat( Quant( M_g w + G f + b_g + n_g ) )        a_m = Sat( Quant( M_a f + b_a + n_a ) )
//   M = (I + diag(scale_error)) (I + misalignment)       misalignment_ij: the share of axis j that axis i feels
//   n_i ~ N(0, factor^2 sigma^2/dt) each axis            b_{i+1} = b_i + sigma_b sqrt(dt) N(0, I)
//   Quant(x) = q round(x/q)                              Sat(x) = clamp(x, -limit, limit)
// The sample is taken at i dt and stamped i dt + jitter. Then samples drop out. Both spare the first sample, whose
// stamp is that of the prior, and the last, so that the recording spans what it says. Each random defect has a stream
// of its own, indexed by i: no defect changes another's draws.
#pragma once

#include <vector>

#include "core/measurements.h"
#include "core/random.h"
#include "sim/trajectory.h"

namespace plumbline::sim {

struct ImuRecording {
  std::vector<core::ImuSample> samples;
  std::vector<core::TimeNs> stamps_ns;  // of every sample that was taken, also of those that dropped out
  std::vector<core::ImuBias> biases;    // the truth at each of these
};

// Samples at 0, dt, 2 dt, ... up to duration_s. Throws core::RuleError where keys that are sound one by one add up to
// a motion or to errors that no sensor could follow.
ImuRecording simulate_imu(const Trajectory& trajectory, const ImuConfig& config, double gravity_m_s2, double duration_s,
                          core::TrialId id);

}  // namespace plumbline::sim
