#include "tools/run_trial.h"

#include <ctime>

#include "estimator/estimate.h"
#include "estimator/keyframes.h"
#include "eval/metric_bound.h"
#include "sim/simulate.h"

// Of OpenMP. CHOLMOD asks for four threads whatever their number is set to; no level of parallel regions leaves it one.
// It counts for the thread that calls it.
extern "C" void omp_set_max_active_levels(int) __attribute__((weak));

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

// NEES and bound speak of a prior whose mean was drawn with the covariance that the estimator is given. Exact means
// leave no room for them at all, and a fixed mean of td or readout none for its own and for what holds it.
void withhold_claims(const Experiment& experiment, std::vector<eval::Metric>& metrics) {
  const sim::PriorConfig& prior = experiment.scenario.prior;
  const bool no_claim = !reason_to_claim_nothing(experiment).empty();
  const bool exact = prior.means == sim::PriorMeans::kTruth;
  for (eval::Metric& metric : metrics) {
    const bool of_both = metric.name == "calibration" || metric.name == "joint";
    const bool of_td = of_both || metric.name.starts_with("td_");
    const bool of_readout = of_both || metric.name.starts_with("readout_") || metric.name == "td_first_error_s";
    const bool no_room = exact || (prior.td_mean_s && of_td) || (prior.readout_mean_s && of_readout);
    if (no_claim || no_room) {
      metric.nees.reset();
      metric.nees_dof = 0;
    }
    if (no_room) metric.crlb.reset();
  }
}

// The bound of what the estimator was given: the keyframes' observations of the kinds that it uses.
void add_bound(const Experiment& experiment, const core::MeasurementLog& measurements, const sim::GroundTruth& truth,
               core::TimeNs start, eval::TrialResult& result) {
  const estimator::EstimateWhat& free = experiment.estimator.estimate;
  const eval::CramerRaoBound bound = eval::cramer_rao_bound(
      measurements, truth,
      {.frames = estimator::select_keyframes(measurements.frames, experiment.estimator.keyframe_rate_hz),
       .td = free.td,
       .readout = free.readout,
       .extrinsics = free.extrinsics,
       .intrinsics = free.intrinsics,
       .points = estimator::uses_points(experiment.estimator.use),
       .lines = estimator::uses_lines(experiment.estimator.use),
       .alignment = experiment.metrics.alignment,
       .causal = true});
  eval::add_bounds(bound, result.metrics);
  result.metrics.push_back({std::string(eval::kKappa2), bound.kappa2});
  result.series.bound = eval::bound_series(bound, start);
}

}  // namespace

std::string reason_to_claim_nothing(const Experiment& experiment) {
  if (experiment.estimator.loss != estimator::RobustLoss::kNone) return "the estimator has a robust loss";
  const sim::PriorConfig& prior = experiment.scenario.prior;
  if (prior.means == sim::PriorMeans::kDrawn && prior.calibration_sigmas().has_intrinsics() &&
      !experiment.estimator.estimate.intrinsics) {
    return "the camera is held, and not known exactly";
  }
  return {};
}

eval::TrialResult run_trial(const Experiment& experiment, core::TrialId trial, TrialTimings* timings) {
  if (omp_set_max_active_levels != nullptr) omp_set_max_active_levels(0);
  ThreadClock clock;
  TrialTimings t;
  const auto [measurements, truth] = sim::simulate(experiment.scenario, trial);
  t.simulate_s = clock.lap();
  const core::EstimateLog estimate = estimator::estimate(measurements, experiment.estimator);
  t.estimate_s = clock.lap();
  eval::TrialResult result = eval::evaluate(estimate, truth, experiment.metrics);
  if (experiment.metrics.crlb && result.ok) {
    add_bound(experiment, measurements, truth, estimate.states.front().t_ns, result);
  }
  withhold_claims(experiment, result.metrics);
  t.evaluate_s = clock.lap();
  if (timings != nullptr) *timings = t;
  return result;
}

}  // namespace plumbline::tools
