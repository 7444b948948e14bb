// The one place that joins simulator, estimator and evaluator.
#pragma once

#include <string>

#include "core/random.h"
#include "eval/evaluate.h"
#include "tools/experiment.h"

namespace plumbline::tools {

// CPU seconds of the thread.
struct TrialTimings {
  double simulate_s = 0.0;
  double estimate_s = 0.0;
  double evaluate_s = 0.0;
};

// Why neither NEES nor efficiency may be claimed of any trial; empty where they may. A robust loss bends the likelihood
// that a covariance is of, and a camera that is wrong is no part of it; the bound is of the data, of a camera that is
// held as if it were known, and stays.
std::string reason_to_claim_nothing(const Experiment& experiment);

eval::TrialResult run_trial(const Experiment& experiment, core::TrialId trial, TrialTimings* timings = nullptr);

}  // namespace plumbline::tools
