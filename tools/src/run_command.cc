#include <algorithm>
#include <atomic>
#include <csignal>
#include <cstdio>
#include <fstream>
#include <thread>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "core/atomic_file.h"
#include "core/error.h"
#include "eval/progress.h"
#include "eval/result_store.h"
#include "eval/runner.h"
#include "eval/summary.h"
#include "eval/summary_table.h"
#include "tools/commands.h"
#include "tools/experiment.h"
#include "tools/run_trial.h"
#include "tools/version.h"

namespace plumbline::tools {
namespace {

using nlohmann::ordered_json;

// Set by Ctrl-C: the trials under way are finished, no further one is begun.
std::atomic<bool> cancelled{false};
void cancel(int) { cancelled = true; }

// What one trial gives to the files.
struct Finished {
  eval::Row row;
  std::string series;  // JSON, empty where the trial failed
  TrialTimings timings;
};

eval::Row identity(const Plan& plan, int index) {
  const int trials = plan.base.experiment.trials;
  eval::Row row;
  row.cell = index / trials;
  row.trial = index % trials;
  row.seed = plan.base.experiment.seed;
  row.run_id = run_id(plan.cells[static_cast<std::size_t>(row.cell)], row.trial);
  return row;
}

Finished run_one(const Plan& plan, int index) {
  Finished finished;
  const eval::Row row = identity(plan, index);
  const Experiment& experiment = plan.cells[static_cast<std::size_t>(row.cell)].experiment;
  const core::TrialId id{row.seed, static_cast<std::uint64_t>(row.trial)};
  const eval::TrialResult result = run_trial(experiment, id, &finished.timings);
  finished.row = eval::with_result(row, result);
  if (result.ok) finished.series = eval::to_json(result.series).dump() + "\n";
  return finished;
}

// Mean CPU seconds a trial.
ordered_json runtime_summary(const TrialTimings& sum, int n) {
  const double per = n > 0 ? 1.0 / n : 0.0;
  return {
      {"simulate_s", sum.simulate_s * per}, {"estimate_s", sum.estimate_s * per}, {"evaluate_s", sum.evaluate_s * per}};
}

// A folder may hold results of the same configuration with at most as many trials; all else would be lost.
void refuse_to_lose(const std::filesystem::path& out, const Plan& plan, bool fresh) {
  core::require_no_file_above(out);
  const std::filesystem::path manifest = out / "manifest.json";
  if (std::filesystem::exists(out) && !std::filesystem::is_directory(out)) {
    throw core::DataError(fmt::format("{}: exists and is not a folder", out.generic_string()));
  }
  if (fresh || !std::filesystem::exists(manifest)) return;
  const ordered_json old = ordered_json::parse(std::ifstream(manifest), nullptr, false);
  const bool same = old.is_object() && old.value("config_hash", "") == plan.config_hash;
  if (!same) {
    throw core::DataError(
        fmt::format("{}: holds results of another configuration; choose another --out, or discard them with --fresh",
                    out.generic_string()));
  }
  if (old.contains("experiment") && old["experiment"].value("trials", 0) > plan.base.experiment.trials) {
    throw core::DataError(fmt::format("{}: holds results of more trials; ask for as many, or discard them with --fresh",
                                      out.generic_string()));
  }
}

std::ofstream open_lines(const std::filesystem::path& path) {
  std::ofstream file(path, std::ios::binary | std::ios::trunc);
  if (!file) throw std::system_error(errno, std::generic_category(), path.generic_string());
  return file;
}

ordered_json summarise_results(const Plan& plan, const std::filesystem::path& out, const TrialTimings& timings,
                               std::vector<eval::CellSummary>& cells) {
  std::vector<std::vector<eval::Row>> rows(plan.cells.size());
  eval::for_each_row(out / "results.jsonl", eval::Tail::kWhole,
                     [&](const eval::Row& row) { rows[static_cast<std::size_t>(row.cell)].push_back(row); });
  ordered_json json_cells = ordered_json::array();
  for (std::size_t i = 0; i < plan.cells.size(); ++i) {
    const bool robust = plan.cells[i].experiment.estimator.loss != estimator::RobustLoss::kNone;
    cells.push_back(eval::summarise(rows[i], plan.cells[i].axes, robust ? "the estimator has a robust loss" : ""));
    json_cells.push_back(eval::to_json(cells.back()));
  }
  return {{"experiment", plan.base.experiment.name},
          {"git", commit()},
          {"config_hash", plan.config_hash},
          {"error", eval::kErrorDefinition},
          {"cells", json_cells},
          {"runtime_s", runtime_summary(timings, plan.runs())}};
}

}  // namespace

int run(const RunOptions& options) {
  std::vector<std::string> overrides = options.set;
  if (options.trials) overrides.push_back(fmt::format("experiment.trials={}", *options.trials));
  const Plan plan = load_plan(options.experiment, overrides, options.only);
  const std::filesystem::path out = options.out.value_or(std::filesystem::path("out") / plan.base.experiment.name);
  refuse_to_lose(out, plan, options.fresh);
  std::filesystem::create_directories(out);
  if (options.fresh) std::filesystem::remove_all(out / "series");
  std::filesystem::create_directories(out / "series");
  core::write_file_atomically(out / "manifest.json", to_manifest(plan).dump(2) + "\n");

  cancelled = false;
  std::signal(SIGINT, cancel);
  std::signal(SIGTERM, cancel);
  const int jobs = options.jobs > 0 ? options.jobs : std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  eval::ResultWriter results(out / "results.jsonl");
  std::ofstream timings_file = open_lines(out / "timings.jsonl");
  std::ofstream incidents_file = open_lines(out / "incidents.jsonl");
  TrialTimings timings_sum;
  int written = 0;
  int failed = 0;
  int incidents = 0;
  int done = 0;
  {
    eval::Progress progress(stderr, plan.runs());
    const eval::TrialHandlers<Finished> handlers{
        .sink =
            [&](int, const Finished& finished) {
              // Rows follow each other without a gap, also where an incident left one out.
              results.add(written++, finished.row);
              if (!finished.series.empty()) {
                core::write_file_atomically(out / "series" / (finished.row.run_id + ".json"), finished.series);
              }
              const TrialTimings& t = finished.timings;
              timings_file << ordered_json{{"run_id", finished.row.run_id},
                                           {"simulate_s", t.simulate_s},
                                           {"estimate_s", t.estimate_s},
                                           {"evaluate_s", t.evaluate_s}}
                                  .dump()
                           << '\n';
              timings_sum.simulate_s += t.simulate_s;
              timings_sum.estimate_s += t.estimate_s;
              timings_sum.evaluate_s += t.evaluate_s;
              failed += finished.row.ok ? 0 : 1;
              progress.add(finished.row.ok);
            },
        .failed_row =
            [&](int index, const std::exception& error) {
              eval::TrialResult result;
              result.status = "exception";
              result.reason = error.what();
              return Finished{.row = eval::with_result(identity(plan, index), result), .series = {}, .timings = {}};
            },
        .incident =
            [&](int index) {
              ++incidents;
              incidents_file
                  << ordered_json{{"run_id", identity(plan, index).run_id}, {"cause", "out of memory"}}.dump() << '\n';
              progress.add(false);
            }};
    done = eval::run_trials<Finished>(
        plan.runs(), jobs, [&](int index) { return run_one(plan, index); }, handlers, &cancelled);
  }
  if (done < plan.runs()) {
    fmt::print(stderr, "plumbline: interrupted after {} of {} runs; they are in {}\n", done, plan.runs(),
               (out / "results.jsonl.tmp").generic_string());
    return kExitInternal;
  }
  results.finish();

  std::vector<eval::CellSummary> cells;
  const ordered_json summary = summarise_results(plan, out, timings_sum, cells);
  core::write_file_atomically(out / "summary.json", summary.dump(2) + "\n");
  if (options.json) {
    fmt::print("{}\n", summary.dump(2));
  } else {
    fmt::print("{}\nresults: {}\n", eval::summary_table(cells), out.generic_string());
  }
  if (incidents > 0) {
    fmt::print(stderr, "plumbline: {} runs were lost to the machine, see {}\n", incidents,
               (out / "incidents.jsonl").generic_string());
    return kExitInternal;
  }
  return failed > plan.base.experiment.max_failed_share * plan.runs() ? kExitWorse : kExitOk;
}

}  // namespace plumbline::tools
