#include "tools/commands.h"

#include <exception>
#include <stdexcept>

#include <fmt/format.h>

#include "core/dataset.h"
#include "core/error.h"
#include "core/hash.h"
#include "core/resolved_config.h"
#include "estimator/estimate.h"
#include "output_folders.h"
#include "sim/simulate.h"
#include "sim/trajectory.h"
#include "tools/experiment.h"
#include "tools/export_results.h"
#include "tools/external_estimator.h"
#include "tools/plot.h"

namespace plumbline::tools {
namespace {

// The file read as one of that kind, in words.
std::string load_as(ConfigKind kind, const std::filesystem::path& file, const std::vector<std::string>& set) {
  switch (kind) {
    case ConfigKind::kExperiment: {
      const Plan plan = load_plan(file, set);
      return fmt::format("experiment '{}', {} cells x {} trials", plan.base.experiment.name, plan.cells.size(),
                         plan.base.experiment.trials);
    }
    case ConfigKind::kScenario:
      load_scenario(file, set);
      return "scenario";
    case ConfigKind::kEstimator:
      load_estimator(file, set);
      return "estimator";
  }
  throw std::logic_error("load_as: unknown kind");
}

int estimate_by_program(const core::MeasurementLog& log, const estimator::ExternalConfig& config,
                        const std::filesystem::path& out) {
  require_runnable(config);
  const ExternalEstimate estimate = estimate_externally(log, config, out);
  if (!estimate.failure.empty()) {
    fmt::print(stderr, "plumbline: {}; its output is in {}\n", estimate.failure, out.generic_string());
    return kExitWorse;
  }
  const core::EstimateLog& stated = estimate.stated.log;
  fmt::print("{}{}{}, {} poses\nestimate: {}\n", core::kSolveStatusNames[static_cast<std::size_t>(stated.status)],
             stated.reason.empty() ? "" : ": ", stated.reason, stated.states.size(), out.generic_string());
  return stated.status == core::SolveStatus::kConverged ? kExitOk : kExitWorse;
}

}  // namespace

int simulate(const SimulateOptions& options) {
  refuse_existing(options.out);
  const sim::ScenarioConfig scenario = load_scenario(options.scenario, options.set);
  const core::TrialId id{options.seed, options.trial};
  const sim::Simulation simulation = sim::simulate(scenario, id);
  const std::string hash = core::content_hash(core::resolved_config(scenario, core::PathForm::kContentHash).dump());
  write_simulation(options.out, simulation, {.config_hash = hash, .seed = id.seed, .trial = id.trial});

  const auto trajectory = sim::make_trajectory(scenario.trajectory, scenario.duration_s, id);
  const sim::MotionStrength m = sim::motion_strength(*trajectory, scenario.duration_s);
  std::size_t observations = 0;
  std::size_t lines = 0;
  for (const core::Frame& frame : simulation.measurements.frames) {
    observations += frame.points.size();
    lines += frame.lines.size();
  }
  const std::size_t frames = simulation.measurements.frames.size();
  fmt::print(
      "path {:.2f} m, rms: speed {:.3f} m/s, acceleration {:.3f} m/s^2, rate {:.3f} rad/s (peak {:.3f}), "
      "angular acceleration {:.3f} rad/s^2\n",
      m.path_m, m.speed_rms_m_s, m.acceleration_rms_m_s2, m.rate_rms_rad_s, m.rate_peak_rad_s,
      m.angular_acceleration_rms_rad_s2);
  if (const auto spline = sim::spline_report(scenario.trajectory, scenario.duration_s)) {
    fmt::print(
        "spline of {}, format {}, poses {:.3f} to {:.3f} s after the first; fit residual, rms: {:.3g} m, {:.3g} rad\n",
        scenario.trajectory.file.generic_string(), core::kPoseFormatNames[static_cast<std::size_t>(spline->format)],
        spline->from_s, spline->to_s, spline->residuals.position_rms_m, spline->residuals.rotation_rms_rad);
  }
  const auto a_frame = [&](std::size_t n) {
    return frames > 0 ? static_cast<double>(n) / static_cast<double>(frames) : 0.0;
  };
  fmt::print("{} IMU samples, {} frames, {} points, {:.1f} a frame, {} tracks\n", simulation.measurements.imu.size(),
             frames, observations, a_frame(observations), simulation.truth.track_landmark.size());
  if (!simulation.truth.segments_W.empty()) {
    fmt::print("{} lines, {:.1f} a frame, {} tracks of {} segments\n", lines, a_frame(lines),
               simulation.truth.track_segment.size(), simulation.truth.segments_W.size());
  }
  fmt::print("dataset: {}\n", options.out.generic_string());
  if (options.plot) {
    const std::filesystem::path plots = options.out / "plots";
    write_plots(plots, {.scenario = scenario,
                        .trajectory = *trajectory,
                        .world = sim::make_world(scenario, *trajectory, id),
                        .simulation = simulation,
                        .title = options.scenario.stem().string()});
    fmt::print("plots: {}\n", plots.generic_string());
  }
  return kExitOk;
}

int estimate(const EstimateOptions& options) {
  refuse_existing(options.out);
  const estimator::EstimatorConfig config = load_estimator(options.estimator, options.set);
  const core::MeasurementLog log = core::read_dataset(options.dataset);
  if (config.type == estimator::EstimatorType::kExternal) return estimate_by_program(log, config.external, options.out);
  const core::EstimateLog estimate = estimator::estimate(log, config);
  write_estimate(options.out, estimate);
  fmt::print("{}{}{}, {} iterations, cost per degree of freedom {:.4f}\n",
             core::kSolveStatusNames[static_cast<std::size_t>(estimate.status)], estimate.reason.empty() ? "" : ": ",
             estimate.reason, estimate.summary.iterations, estimate.summary.cost_per_dof());
  const auto sigma = [&](int i) { return std::sqrt(estimate.covariance(i, i)); };
  fmt::print("td {:.6f} ms (sigma {:.6f}), readout {:.6f} ms (sigma {:.6f}), middle row\n",
             1e3 * estimate.calibration.td_s, 1e3 * sigma(core::kCovTd), 1e3 * estimate.calibration.readout_s,
             1e3 * sigma(core::kCovReadout));
  if (const auto& K = estimate.calibration.intrinsics) {
    fmt::print(
        "fx {:.4f} px (sigma {:.4f}), fy {:.4f} px (sigma {:.4f}), cx {:.4f} px (sigma {:.4f}), cy {:.4f} px "
        "(sigma {:.4f})\n",
        (*K)[0], sigma(core::kCovIntrinsics), (*K)[1], sigma(core::kCovIntrinsics + 1), (*K)[2],
        sigma(core::kCovIntrinsics + 2), (*K)[3], sigma(core::kCovIntrinsics + 3));
  }
  fmt::print("estimate: {}\n", options.out.generic_string());
  return estimate.status == core::SolveStatus::kConverged ? kExitOk : kExitWorse;
}

int export_results(const ExportResultsOptions& options) {
  switch (options.format) {
    case ResultsFormat::kCsv:
      export_csv(options.results, options.out);
      break;
    case ResultsFormat::kSqlite:
      export_sqlite(options.results, options.out);
      break;
  }
  fmt::print("{}\n", options.out.generic_string());
  return kExitOk;
}

int check(const CheckOptions& options) {
  if (options.keys) fmt::print("{}", key_table());
  for (const std::filesystem::path& file : options.files) {
    std::string what;
    std::exception_ptr refusal;  // of the kind that is likeliest
    for (const ConfigKind kind : config_kinds(file)) {
      try {
        const std::string loaded = load_as(kind, file, options.set);
        what += (what.empty() ? "" : " or ") + loaded;
      } catch (const core::InputError&) {
        if (!refusal) refusal = std::current_exception();
      }
    }
    if (what.empty()) std::rethrow_exception(refusal);
    fmt::print("{}: {}\n", file.generic_string(), what);
  }
  return kExitOk;
}

}  // namespace plumbline::tools
