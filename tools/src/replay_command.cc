#include <charconv>
#include <cstdio>
#include <fstream>
#include <optional>
#include <sstream>

#include <fmt/format.h>

#include "core/atomic_file.h"
#include "core/error.h"
#include "estimator/estimate.h"
#include "output_folders.h"
#include "sim/simulate.h"
#include "tools/blas.h"
#include "tools/external_estimator.h"
#include "tools/sweep.h"

namespace plumbline::tools {
namespace {

namespace fs = std::filesystem;

std::optional<int> parse_number(const std::string& text, int end) {
  int number = 0;
  const auto [last, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  const bool valid = error == std::errc() && last == text.data() + text.size() && number >= 0 && number < end;
  return valid ? std::optional(number) : std::nullopt;
}

int find_run(const Plan& plan, const ReplayOptions& options) {
  const std::string where = (options.results / "manifest.json").generic_string();
  const int trials = plan.base.experiment.trials;
  if (options.run.size() == 2) {
    const auto cell = parse_number(options.run[0], static_cast<int>(plan.cells.size()));
    const auto trial = parse_number(options.run[1], trials);
    if (cell && trial) return *cell * trials + *trial;
    throw core::DataError(fmt::format("{}: no cell {} with a trial {}", where, options.run[0], options.run[1]));
  }
  for (int index = 0; index < plan.runs(); ++index) {
    if (identity(plan, index).run_id == options.run[0]) return index;
  }
  throw core::DataError(fmt::format("{}: no run with id '{}'", where, options.run[0]));
}

// In that order, so that what an estimator dies of is there to be looked at.
void dump(const Plan& plan, const eval::Row& row, const fs::path& folder) {
  const Cell& cell = plan.cells[static_cast<std::size_t>(row.cell)];
  const core::TrialId id{row.seed, static_cast<std::uint64_t>(row.trial)};
  const sim::Simulation simulation = sim::simulate(cell.experiment.scenario, id);
  write_simulation(folder / "dataset", simulation,
                   {.config_hash = cell.config_hash, .seed = id.seed, .trial = id.trial});
  const estimator::EstimatorConfig& config = cell.experiment.estimator;
  if (config.type == estimator::EstimatorType::kExternal) {
    estimate_externally(simulation.measurements, config.external, folder / "estimate");
  } else {
    write_estimate(folder / "estimate", estimator::estimate(simulation.measurements, config));
  }
}

// The row and the series of a run as text.
struct Replayed {
  std::string row;
  std::string series;
};

// In a worker, like the runs of a sweep, since it may take its process with it.
Replayed run_again(const Plan& plan, int index, const ReplayOptions& options, const TrialFunction& trial) {
  Replayed replayed;
  const auto answer = [&](int) {
    if (options.dump) dump(plan, identity(plan, index), *options.dump);
    const Finished finished = run_one(plan, index, trial);
    return eval::to_line(finished.row) + "\n" + finished.series;
  };
  const auto take = [&](const eval::TrialEnd& end) {
    if (end.outcome == eval::Outcome::kAnswer) {
      const std::size_t line = end.text.find('\n');
      replayed = {end.text.substr(0, line), end.text.substr(line + 1)};
    } else if (end.outcome == eval::Outcome::kException || end.outcome == eval::Outcome::kCrash) {
      replayed.row = eval::to_line(failed_row(plan, index, end));
    } else {
      throw std::runtime_error("the machine ended the run: " + end.text);
    }
  };
  eval::run_in_processes({index},
                         {.trial = answer, .sink = take, .jobs = 1, .cpu_limit_s = plan.base.experiment.cpu_limit_s});
  return replayed;
}

std::string contents(const fs::path& path) {
  std::ostringstream text;
  text << std::ifstream(path, std::ios::binary).rdbuf();
  return text.str();
}

}  // namespace

std::string replay_command(const fs::path& out, const eval::Row& row) {
  return fmt::format("plumbline replay {} {} {}", out.generic_string(), row.cell, row.trial);
}

int replay(const ReplayOptions& options) { return replay(options, run_trial); }

int replay(const ReplayOptions& options, const TrialFunction& trial) {
  use_one_blas_thread();
  if (options.dump) refuse_existing(*options.dump);
  const Plan plan = read_manifest(options.results / "manifest.json");
  const int index = find_run(plan, options);
  const SweepState state = read_state(plan, options.results);
  require_sound(state);
  const Replayed replayed = run_again(plan, index, options, trial);
  if (options.dump && !replayed.series.empty()) {
    core::write_file_atomically(*options.dump / "series.json", replayed.series);
  }
  fmt::print("{}\n", replayed.row);

  const RunState& run = state.runs[static_cast<std::size_t>(index)];
  if (!run.row) {
    fmt::print(stderr, "no row is stored to compare with\n");
    return kExitOk;
  }
  const std::string row = state.read(run.row);
  const fs::path series = options.results / "series" / (identity(plan, index).run_id + ".json");
  const bool same_series = !run.ok || contents(series) == replayed.series;
  if (row == replayed.row && same_series) {
    fmt::print(stderr, "identical to the stored row{}\n", run.ok ? " and series" : "");
    return kExitOk;
  }
  if (row != replayed.row) fmt::print(stderr, "differs from the stored row:\n{}\n", row);
  if (!same_series) fmt::print(stderr, "differs from the stored series: {}\n", series.generic_string());
  return kExitInternal;
}

}  // namespace plumbline::tools
