// The one place that joins simulator, estimator and evaluator.
#pragma once

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

eval::TrialResult run_trial(const Experiment& experiment, core::TrialId trial, TrialTimings* timings = nullptr);

}  // namespace plumbline::tools
