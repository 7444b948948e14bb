#include <algorithm>
#include <ctime>
#include <fstream>
#include <iterator>
#include <thread>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "core/atomic_file.h"
#include "core/error.h"
#include "tools/commands.h"
#include "tools/experiment.h"
#include "tools/run_trial.h"

namespace plumbline::tools {
namespace {

// CPU seconds of the first trial of the cell, which is run for real and forgotten; says how it went.
double probe(const Plan& plan, const Cell& cell) {
  std::string outcome = "ok";
  TrialTimings timings;
  const std::clock_t start = std::clock();
  try {
    const eval::TrialResult result = run_trial(cell.experiment, {plan.base.experiment.seed, 0}, &timings);
    if (!result.ok) outcome = fmt::format("{}: {}", result.status, result.reason);
  } catch (const core::InputError&) {
    throw;
  } catch (const std::exception& error) {
    outcome = fmt::format("exception: {}", error.what());
  }
  const double own_s = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
  const double cpu_s = std::max(own_s, timings.simulate_s + timings.estimate_s + timings.evaluate_s);
  fmt::print("probe: cell {}, {:.3g} s of CPU, {}\n", cell.axes.dump(), cpu_s, outcome);
  return cpu_s;
}

// In the unit that suits it.
std::string duration(double s) {
  if (s < 120.0) return fmt::format("{:.3g} s", s);
  if (s < 7200.0) return fmt::format("{:.3g} min", s / 60.0);
  return fmt::format("{:.3g} h", s / 3600.0);
}

void estimate_time(const Plan& plan, int jobs) {
  double mean_s = probe(plan, plan.cells.front());
  const int probes = plan.cells.size() > 1 ? 2 : 1;
  if (probes == 2) mean_s = 0.5 * (mean_s + probe(plan, plan.cells.back()));
  const double cpu_s = mean_s * plan.runs();
  fmt::print("estimate from {} trial{}: {} of CPU, {} with {} at a time\n", probes, probes == 1 ? "" : "s",
             duration(cpu_s), duration(cpu_s / std::min(jobs, plan.runs())), jobs);
}

// A manifest does not change once it is there.
void write_manifest(const std::filesystem::path& file, const std::string& text) {
  if (std::filesystem::exists(file)) {
    std::ifstream stream(file, std::ios::binary);
    if (std::string(std::istreambuf_iterator<char>(stream), {}) != text) {
      throw core::DataError(fmt::format("{}: is of another plan; choose another --out", file.generic_string()));
    }
    return;
  }
  core::require_no_file_above(file);
  std::filesystem::create_directories(file.parent_path());
  core::write_file_atomically(file, text);
}

}  // namespace

int plan(const PlanOptions& options) {
  std::vector<std::string> overrides = options.set;
  if (options.trials) overrides.push_back(fmt::format("experiment.trials={}", *options.trials));
  const Plan plan = load_plan(options.experiment, overrides, options.only);
  const ExperimentConfig& experiment = plan.base.experiment;
  fmt::print("{}: {} cells x {} trials = {} runs\n", experiment.name, plan.cells.size(), experiment.trials,
             plan.runs());
  if (options.dry_run) {
    const int processors = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
    estimate_time(plan, options.jobs > 0 ? options.jobs : processors);
    return kExitOk;
  }
  const std::filesystem::path out = options.out.value_or(std::filesystem::path("out") / experiment.name);
  write_manifest(out / "manifest.json", to_manifest(plan).dump(2) + "\n");
  fmt::print("manifest: {}\n", (out / "manifest.json").generic_string());
  return kExitOk;
}

}  // namespace plumbline::tools
