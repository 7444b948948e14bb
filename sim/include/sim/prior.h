// What the estimator is told beforehand: the truth plus a draw of exactly the covariance that it is given, so that the
// prior is one more noisy measurement.
#pragma once

#include "core/measurements.h"
#include "core/random.h"
#include "sim/ground_truth.h"
#include "sim/scenario.h"

namespace plumbline::sim {

// For the state of the first IMU sample.
core::InitialPrior make_prior(const GroundTruth& truth, const ScenarioConfig& config, core::TrialId id);

}  // namespace plumbline::sim
