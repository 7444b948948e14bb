#include "tools/run_trial.h"

#include <ctime>

#include "estimator/estimate.h"
#include "sim/simulate.h"

namespace plumbline::tools {
namespace {

// CPU time of this thread since the last call of lap().
class ThreadClock {
 public:
  double lap() {
    const double now = read();
    const double elapsed = now - last_;
    last_ = now;
    return elapsed;
  }

 private:
  static double read() {
    timespec t{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
  }
  double last_ = read();
};

}  // namespace

eval::TrialResult run_trial(const Experiment& experiment, core::TrialId trial, TrialTimings* timings) {
  ThreadClock clock;
  TrialTimings t;
  const auto [measurements, truth] = sim::simulate(experiment.scenario, trial);
  t.simulate_s = clock.lap();
  const core::EstimateLog estimate = estimator::estimate(measurements, experiment.estimator);
  t.estimate_s = clock.lap();
  eval::TrialResult result = eval::evaluate(estimate, truth, experiment.metrics);
  t.evaluate_s = clock.lap();
  if (timings != nullptr) *timings = t;
  return result;
}

}  // namespace plumbline::tools
