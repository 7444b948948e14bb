#include "tools/run_trial.h"

#include <algorithm>
#include <ctime>
#include <iterator>

#include <fmt/format.h>

#include "estimator/estimate.h"
#include "estimator/keyframes.h"
#include "eval/association.h"
#include "eval/metric_bound.h"
#include "sim/simulate.h"
#include "tools/external_estimator.h"

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

// What an estimate folder has no place for, and what this one leaves out, is no error of 0.
void leave_out_unstated(const StatedEstimate& stated, std::vector<eval::Metric>& metrics) {
  std::erase_if(metrics, [&](const eval::Metric& metric) {
    const std::string_view name = metric.name;
    if (name == "final_velocity" || name == "final_state" || name == "joint" || name.ends_with("_bias")) return true;
    if (name == "calibration" || name.starts_with("extrinsic")) return !stated.extrinsics;
    if (name == "td_first_error_s") return !stated.td || !stated.readout;
    if (name.starts_with("td_")) return !stated.td;
    return name == "readout_error_s" && !stated.readout;
  });
}

// Of the true poses from the first frame to the last.
double coverage_of_frames(const core::EstimateLog& estimate, const core::MeasurementLog& measurements,
                          const sim::GroundTruth& truth) {
  if (measurements.frames.empty()) return 0.0;
  std::vector<core::StampedPose> estimated;
  estimated.reserve(estimate.states.size());
  for (const core::StampedState& s : estimate.states) estimated.push_back({s.t_ns, s.state.T_W_B});
  const core::TimeNs td_ns = core::to_ns(truth.calibration.td_s);
  std::vector<core::StampedPose> seen;
  for (const core::StampedState& s : truth.states) {
    const core::TimeNs t_cam_ns = s.t_ns - td_ns;
    if (t_cam_ns < measurements.frames.front().t_cam_ns || t_cam_ns > measurements.frames.back().t_cam_ns) continue;
    seen.push_back({s.t_ns, s.state.T_W_B});
  }
  return eval::associate(estimated, seen).coverage;
}

eval::TrialResult failed(std::string_view status, std::string reason) {
  eval::TrialResult result;
  result.status = status;
  result.reason = std::move(reason);
  return result;
}

eval::TrialResult evaluate_external(const ExternalEstimate& estimate, const core::MeasurementLog& measurements,
                                    const sim::GroundTruth& truth, const eval::MetricsConfig& config) {
  if (!estimate.failure.empty()) return failed("external", estimate.failure);
  eval::TrialResult result = eval::evaluate(estimate.stated.log, truth, config);
  if (!result.ok) return result;
  constexpr double kLeastCoverage = 0.9;
  const double coverage = coverage_of_frames(estimate.stated.log, measurements, truth);
  if (coverage < kLeastCoverage) {
    return failed("unusable",
                  fmt::format("the poses cover {:.1f} % of the frames' time, less than 90 %", 100.0 * coverage));
  }
  leave_out_unstated(estimate.stated, result.metrics);
  return result;
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
  ExternalEstimate external;
  core::EstimateLog& estimate = external.stated.log;
  eval::TrialResult result;
  if (experiment.estimator.type == estimator::EstimatorType::kExternal) {
    const ScratchFolder scratch;
    external = estimate_externally(measurements, experiment.estimator.external, scratch.path() / "out");
    t.estimate_s = clock.lap() + external.cpu_s;
    result = evaluate_external(external, measurements, truth, experiment.metrics);
  } else {
    estimate = estimator::estimate(measurements, experiment.estimator);
    t.estimate_s = clock.lap();
    result = eval::evaluate(estimate, truth, experiment.metrics);
  }
  if (experiment.metrics.crlb && result.ok) {
    add_bound(experiment, measurements, truth, estimate.states.front().t_ns, result);
  }
  withhold_claims(experiment, result.metrics);
  t.evaluate_s = clock.lap();
  if (timings != nullptr) *timings = t;
  return result;
}

}  // namespace plumbline::tools
