#include <algorithm>
#include <atomic>
#include <csignal>
#include <cstdio>
#include <fstream>
#include <optional>
#include <thread>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "core/atomic_file.h"
#include "core/error.h"
#include "eval/runner.h"
#include "eval/series.h"
#include "recorder.h"
#include "tools/blas.h"
#include "tools/folder_lock.h"
#include "tools/sweep.h"

namespace plumbline::tools {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

// Set by Ctrl-C: the trials under way are finished, no further one is begun. A second one ends the program.
std::atomic<bool> cancelled{false};
void cancel(int) { cancelled = true; }

void finish_trials_on_signals() {
  cancelled = false;
  struct sigaction action{};
  action.sa_handler = cancel;
  action.sa_flags = SA_RESETHAND;
  ::sigaction(SIGINT, &action, nullptr);
  ::sigaction(SIGTERM, &action, nullptr);
}

int jobs_of(const RunOptions& options) {
  return options.jobs > 0 ? options.jobs : std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
}

void require_safe_threads(const RunOptions& options) {
  if (options.launcher == Launcher::kThreads && jobs_of(options) > 1 && !blas_is_thread_safe()) {
    throw core::DataError(
        "--launcher threads: this OpenBLAS is not safe among threads; install libopenblas0-pthread, or use processes");
  }
}

// A folder may hold results of the same configuration with at most as many trials; all else would be lost.
void refuse_to_lose(const fs::path& out, const Plan& plan, bool fresh) {
  core::require_no_file_above(out);
  const fs::path manifest = out / "manifest.json";
  if (fs::exists(out) && !fs::is_directory(out)) {
    throw core::DataError(fmt::format("{}: exists and is not a folder", out.generic_string()));
  }
  if (fresh || !fs::exists(manifest)) return;
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

void discard(const fs::path& out) {
  for (const char* name :
       {"results.jsonl", "timings.jsonl", "incidents.jsonl", "summary.json", "manifest.json", "report.html"}) {
    fs::remove(out / name);
  }
  fs::remove_all(out / "series");
  for (const auto& entry : fs::directory_iterator(out / "shards")) {
    if (entry.path().filename() != "lock") fs::remove(entry.path());
  }
}

// The manifest is the plan's alone, so that it changes only where trials are added.
void write_manifest(const fs::path& out, const Plan& plan) {
  const fs::path file = out / "manifest.json";
  const ordered_json manifest = to_manifest(plan);
  if (fs::exists(file) && ordered_json::parse(std::ifstream(file), nullptr, false) == manifest) return;
  core::write_file_atomically(file, manifest.dump(2) + "\n");
}

Plan plan_of(const RunOptions& options) {
  if (fs::is_directory(options.experiment)) {
    if (options.trials || !options.set.empty() || !options.only.empty() || options.fresh) {
      throw core::DataError(
          fmt::format("{}: --trials, --set, --only and --fresh need the experiment's file, not its folder",
                      options.experiment.generic_string()));
    }
    return read_manifest(options.experiment / "manifest.json");
  }
  std::vector<std::string> overrides = options.set;
  if (options.trials) overrides.push_back(fmt::format("experiment.trials={}", *options.trials));
  return load_plan(options.experiment, overrides, options.only);
}

fs::path folder_of(const RunOptions& options, const Plan& plan) {
  if (options.out) return *options.out;
  return fs::is_directory(options.experiment) ? options.experiment : fs::path("out") / plan.base.experiment.name;
}

// Whether all runs have ended, be it by an incident.
bool run_trials(const Plan& plan, const fs::path& out, const SweepState& state, const std::vector<int>& indices,
                const RunOptions& options, Journal& journal, const TrialFunction& trial) {
  finish_trials_on_signals();
  Recorder recorder(plan, out, journal, state);
  const eval::TrialRun runs{.trial = [&](int index) { return to_answer(run_one(plan, index, trial)); },
                            .sink = [&](const eval::TrialEnd& end) { recorder.add(end); },
                            .jobs = jobs_of(options),
                            .cpu_limit_s = plan.base.experiment.cpu_limit_s,
                            .cancel = &cancelled};
  (options.launcher == Launcher::kThreads ? eval::run_in_threads : eval::run_in_processes)(indices, runs);
  const int done = recorder.counts().done - recorder.counts().before;
  if (done == static_cast<int>(indices.size())) return true;
  fmt::print(stderr, "plumbline: interrupted with {} of {} runs done; to go on: plumbline run {}\n",
             recorder.counts().done, plan.runs(), out.generic_string());
  return false;
}

int run_shard(const Plan& plan, const fs::path& out, Shard shard, const RunOptions& options,
              const TrialFunction& trial) {
  const auto belongs = [&](int index) { return index % shard.of == shard.index; };
  SweepState state = read_state(plan, out);
  require_sound(state);
  std::vector<int> indices = state.incomplete();
  std::erase_if(indices, [&](int index) { return !belongs(index); });
  Journal journal(out, fmt::format("journal-{}", shard.index));
  if (!run_trials(plan, out, state, indices, options, journal, trial)) return kExitInternal;
  state = read_state(plan, out);
  const fs::path file = out / "shards" / fmt::format("shard-{}.jsonl", shard.index);
  publish_shard(state, journal, file, belongs);
  const std::vector<int> left = state.incomplete();
  const bool complete = std::none_of(left.begin(), left.end(), belongs);
  fmt::print(stderr, "plumbline: shard {} of {} is {}: {}\n", shard.index, shard.of,
             complete ? "complete" : "done but for incidents", file.generic_string());
  return complete ? kExitOk : kExitInternal;
}

// Of the runs so far, from some of them; nothing where there are none.
std::optional<double> mean_trial_s(const SweepState& state) {
  constexpr int kEnough = 100;
  double sum_s = 0.0;
  int n = 0;
  for (const RunState& run : state.runs) {
    if (!run.timings || n == kEnough) continue;
    const ordered_json t = ordered_json::parse(state.read(run.timings));
    for (const char* part : {"simulate_s", "estimate_s", "evaluate_s"}) sum_s += t.at(part).get<double>();
    ++n;
  }
  return n > 0 ? std::optional(sum_s / n) : std::nullopt;
}

// One run is made here where none tells yet how long they take.
int run_on_cluster(const Plan& plan, const fs::path& out, const RunOptions& options, SweepState state,
                   const TrialFunction& trial) {
  const std::vector<int> indices = state.incomplete();
  if (indices.empty()) {
    fmt::print(stderr, "plumbline: no run is missing; to join the shards: plumbline merge {}\n", out.generic_string());
    return kExitOk;
  }
  if (!mean_trial_s(state)) {
    RunOptions here = options;
    here.launcher = Launcher::kProcesses;
    Journal journal(out, "probe");
    if (!run_trials(plan, out, state, {indices.front()}, here, journal, trial)) return kExitInternal;
    state = read_state(plan, out);
  }
  return submit(plan, out, options, state, mean_trial_s(state).value_or(0.0));
}

}  // namespace

Finished run_one(const Plan& plan, int index, const TrialFunction& trial) {
  Finished finished{.row = identity(plan, index), .series = {}, .timings = {}};
  const Experiment& experiment = plan.cells[static_cast<std::size_t>(finished.row.cell)].experiment;
  const core::TrialId id{finished.row.seed, static_cast<std::uint64_t>(finished.row.trial)};
  const eval::TrialResult result = trial(experiment, id, &finished.timings);
  finished.row = eval::with_result(finished.row, result);
  if (result.ok) finished.series = eval::to_json(result.series).dump() + "\n";
  return finished;
}

eval::Row failed_row(const Plan& plan, int index, const eval::TrialEnd& end) {
  eval::TrialResult result;
  result.status = end.outcome == eval::Outcome::kCrash ? "crash" : "exception";
  result.reason = end.text;
  return eval::with_result(identity(plan, index), result);
}

int run(const RunOptions& options) { return run(options, run_trial); }

int run(const RunOptions& options, const TrialFunction& trial) {
  require_safe_threads(options);
  use_one_blas_thread();
  const Plan plan = plan_of(options);
  const fs::path out = folder_of(options, plan);
  refuse_to_lose(out, plan, options.fresh);
  if (options.fresh) {
    const FolderLock alone(out, LockKind::kAlone);
    discard(out);
  }
  const bool side_by_side = options.shard || options.launcher == Launcher::kSlurm;
  const FolderLock lock(out, side_by_side ? LockKind::kShared : LockKind::kAlone);
  fs::create_directories(out / "series");
  write_manifest(out, plan);
  if (options.shard) return run_shard(plan, out, *options.shard, options, trial);

  SweepState state = read_state(plan, out);
  require_sound(state);
  const std::vector<int> indices = state.incomplete();
  if (indices.empty() && !state.has_journals() && fs::exists(out / "summary.json")) {
    fmt::print(stderr, "plumbline: nothing to do, all {} runs are in {}\n", plan.runs(), out.generic_string());
    return conclude(plan, out, options.output);
  }
  if (options.launcher == Launcher::kSlurm) return run_on_cluster(plan, out, options, std::move(state), trial);
  {
    Journal journal(out, "journal");
    if (!run_trials(plan, out, state, indices, options, journal, trial)) return kExitInternal;
  }
  publish(read_state(plan, out), out);
  return conclude(plan, out, options.output);
}

}  // namespace plumbline::tools
