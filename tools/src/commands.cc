#include "tools/commands.h"

#include <exception>
#include <optional>
#include <stdexcept>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "core/atomic_file.h"
#include "core/dataset.h"
#include "core/error.h"
#include "core/hash.h"
#include "core/pose_file.h"
#include "core/resolved_config.h"
#include "estimator/estimate.h"
#include "eval/result_store.h"
#include "eval/series.h"
#include "sim/simulate.h"
#include "sim/trajectory.h"
#include "sim/truth_files.h"
#include "tools/experiment.h"
#include "tools/export_results.h"
#include "tools/plot.h"
#include "tools/run_trial.h"
#include "tools/version.h"

namespace plumbline::tools {
namespace {

using nlohmann::ordered_json;

// A recording with its truth beside it.
void write_simulation(const std::filesystem::path& folder, const sim::Simulation& simulation,
                      const core::DatasetMeta& meta) {
  core::write_dataset(folder, simulation.measurements, meta);
  sim::write_truth(folder, simulation.truth);
}

// estimate.tum and meta.yaml, as an external program would write them.
void write_estimate(const std::filesystem::path& folder, const core::EstimateLog& estimate) {
  std::filesystem::create_directories(folder);
  std::vector<core::StampedPose> poses;
  poses.reserve(estimate.states.size());
  for (const core::StampedState& s : estimate.states) poses.push_back({s.t_ns, s.state.T_W_B});
  core::write_tum(folder / "estimate.tum", poses);
  const auto sigma = [&](int i) { return std::sqrt(estimate.covariance(i, i)); };
  ordered_json covariance = ordered_json::array();
  for (int r = 0; r < core::kCovDim; ++r) {
    for (int c = 0; c < core::kCovDim; ++c) covariance.push_back(estimate.covariance(r, c));
  }
  ordered_json meta = {{"schema", "plumbline-estimate/1"},
                       {"version", version()},
                       {"status", core::kSolveStatusNames[static_cast<std::size_t>(estimate.status)]},
                       {"reason", estimate.reason},
                       {"stamp_clock", "imu"},
                       {"td_reference_row", "middle"},
                       {"calibration", core::resolved_config(estimate.calibration)},
                       {"td_sigma_s", sigma(core::kCovTd)},
                       {"readout_sigma_s", sigma(core::kCovReadout)},
                       {"iterations", estimate.summary.iterations},
                       {"final_cost", estimate.summary.final_cost},
                       {"cost_per_dof", estimate.summary.cost_per_dof()},
                       {"covariance_order", "p_B_C, theta_B_C, td, readout, last state (p, theta, v, b_g, b_a)"},
                       {"covariance", covariance}};
  core::write_file_atomically(folder / "meta.yaml", core::to_yaml(meta));
}

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

// Throws where the folder, which need not be there yet, holds something already, or is to lie below a file.
void refuse_existing(const std::filesystem::path& folder) {
  core::require_no_file_above(folder);
  const bool empty = std::filesystem::is_directory(folder) && std::filesystem::is_empty(folder);
  if (std::filesystem::exists(folder) && !empty) {
    throw core::DataError(fmt::format("{}: exists and is not an empty folder", folder.generic_string()));
  }
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
  const core::EstimateLog estimate = estimator::estimate(log, config);
  write_estimate(options.out, estimate);
  fmt::print("{}{}{}, {} iterations, cost per degree of freedom {:.4f}\n",
             core::kSolveStatusNames[static_cast<std::size_t>(estimate.status)], estimate.reason.empty() ? "" : ": ",
             estimate.reason, estimate.summary.iterations, estimate.summary.cost_per_dof());
  fmt::print("td {:.6f} ms (sigma {:.6f}), readout {:.6f} ms (sigma {:.6f}), middle row\nestimate: {}\n",
             1e3 * estimate.calibration.td_s, 1e3 * std::sqrt(estimate.covariance(core::kCovTd, core::kCovTd)),
             1e3 * estimate.calibration.readout_s,
             1e3 * std::sqrt(estimate.covariance(core::kCovReadout, core::kCovReadout)), options.out.generic_string());
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

int replay(const ReplayOptions& options) {
  if (options.out) refuse_existing(*options.out);
  const Plan plan = read_manifest(options.results / "manifest.json");
  const int trials = plan.base.experiment.trials;
  for (const Cell& cell : plan.cells) {
    for (int trial = 0; trial < trials; ++trial) {
      if (run_id(cell, trial) != options.run_id) continue;
      const core::TrialId id{plan.base.experiment.seed, static_cast<std::uint64_t>(trial)};
      eval::Row row;
      row.run_id = options.run_id;
      row.cell = static_cast<int>(&cell - plan.cells.data());
      row.trial = trial;
      row.seed = id.seed;
      eval::TrialResult result;
      try {
        result = run_trial(cell.experiment, id);
      } catch (const core::InputError&) {
        throw;
      } catch (const std::exception& error) {
        result.status = "exception";
        result.reason = error.what();
      }
      row = eval::with_result(row, result);
      if (options.out) {
        const sim::Simulation simulation = sim::simulate(cell.experiment.scenario, id);
        write_simulation(*options.out / "dataset", simulation,
                         {.config_hash = cell.config_hash, .seed = id.seed, .trial = id.trial});
        write_estimate(*options.out / "estimate",
                       estimator::estimate(simulation.measurements, cell.experiment.estimator));
        core::write_file_atomically(*options.out / "series.json", eval::to_json(result.series).dump() + "\n");
      }
      const std::string line = eval::to_line(row);
      fmt::print("{}\n", line);

      std::optional<std::string> stored;
      const std::filesystem::path results = options.results / "results.jsonl";
      if (std::filesystem::exists(results)) {
        eval::for_each_row(results, eval::Tail::kWhole, [&](const eval::Row& r) {
          if (r.run_id == options.run_id) stored = eval::to_line(r);
        });
      }
      if (!stored) return kExitOk;
      if (*stored == line) {
        fmt::print(stderr, "identical to the stored row\n");
        return kExitOk;
      }
      fmt::print(stderr, "differs from the stored row:\n{}\n", *stored);
      return kExitWorse;
    }
  }
  throw core::DataError(
      fmt::format("{}: no run with id '{}'", (options.results / "manifest.json").generic_string(), options.run_id));
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
