// The estimator's front door: measurements in, estimate out. It cannot see the truth.
#pragma once

#include "core/estimate.h"
#include "core/measurements.h"
#include "estimator/config.h"

namespace plumbline::estimator {

// What estimate() asks of noise and priors, so that it can be asked before there are measurements: throws
// core::ConfigError for a noise of 0 and for a free parameter whose prior has no width. has_lines: whether the
// recording holds lines, whose noise need not be known where it holds none.
void require_usable(const EstimatorConfig& config, const BelievedNoise& noise, const core::CalibrationSigmas& sigma,
                    bool has_lines);

// Deterministic; no clock, one thread. What goes wrong with the numbers is a SolveStatus with a reason.
// Throws as require_usable.
core::EstimateLog estimate(const core::MeasurementLog& log, const EstimatorConfig& config);

}  // namespace plumbline::estimator
