// A trial's measurements and the truth behind them.
#pragma once

#include "core/measurements.h"
#include "core/random.h"
#include "sim/ground_truth.h"
#include "sim/scenario.h"

namespace plumbline::sim {

struct Simulation {
  core::MeasurementLog measurements;
  GroundTruth truth;
};

// The IMU records [0, duration_s]; every row of every frame is exposed this long after its beginning and before its
// end, so that an estimate of td may be wrong by as much and still find IMU samples.
inline constexpr double kCameraLeadS = 0.25;

// Deterministic in (config, id). Throws core::DataError where the pose file of a spline cannot
// be used, core::RuleError where keys that are sound one by one do not go together.
Simulation simulate(const ScenarioConfig& config, core::TrialId id);

}  // namespace plumbline::sim
