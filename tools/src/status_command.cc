// `plumbline status` and `plumbline merge`: what the files of a sweep say, whatever programs or schedulers remember.
#include <cstdio>
#include <optional>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "tools/folder_lock.h"
#include "tools/sweep.h"

namespace plumbline::tools {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

struct Tally {
  int runs = 0;
  int ok = 0;
  int failed = 0;
  int incidents = 0;
  int missing = 0;

  void add(const RunState& run) {
    ++runs;
    if (run.row) {
      ++(run.ok ? ok : failed);
    } else {
      ++(run.incident ? incidents : missing);
    }
  }
  int done() const { return ok + failed; }
};

ordered_json to_json(const Tally& t) {
  return {{"runs", t.runs},     {"done", t.done()},         {"ok", t.ok},
          {"failed", t.failed}, {"incidents", t.incidents}, {"missing", t.missing}};
}

std::string line(const Tally& t) {
  std::string text = fmt::format("{}/{} done, {} ok", t.done(), t.runs, t.ok);
  if (t.failed > 0) text += fmt::format(", {} failed", t.failed);
  if (t.incidents > 0) text += fmt::format(", {} incidents", t.incidents);
  if (t.missing > 0) text += fmt::format(", {} missing", t.missing);
  return text;
}

// By cell.
std::vector<Tally> tally(const Plan& plan, const SweepState& state) {
  std::vector<Tally> cells(plan.cells.size());
  for (std::size_t i = 0; i < state.runs.size(); ++i) {
    cells[i / static_cast<std::size_t>(plan.base.experiment.trials)].add(state.runs[i]);
  }
  return cells;
}

Tally sum(const std::vector<Tally>& cells) {
  Tally all;
  for (const Tally& t : cells) {
    all.runs += t.runs;
    all.ok += t.ok;
    all.failed += t.failed;
    all.incidents += t.incidents;
    all.missing += t.missing;
  }
  return all;
}

// "cell 3 {axes}: 12/20 done, ..." of each cell that is not done.
void print_unfinished(std::FILE* stream, const Plan& plan, const std::vector<Tally>& cells) {
  for (std::size_t i = 0; i < cells.size(); ++i) {
    if (cells[i].done() < cells[i].runs) {
      fmt::print(stream, "cell {} {}: {}\n", i, plan.cells[i].axes.dump(), line(cells[i]));
    }
  }
}

}  // namespace

int status(const StatusOptions& options) {
  const Plan plan = read_manifest(options.out / "manifest.json");
  const SweepState state = read_state(plan, options.out);
  const std::vector<Tally> cells = tally(plan, state);
  const std::string holder = folder_holder(options.out);
  if (options.json) {
    ordered_json json = to_json(sum(cells));
    json["writer"] = holder.empty() ? ordered_json() : ordered_json(holder);
    json["damaged"] = state.damaged;
    json["conflicts"] = state.conflicts;
    json["cells"] = ordered_json::array();
    for (std::size_t i = 0; i < cells.size(); ++i) {
      ordered_json cell = {{"axes", plan.cells[i].axes}};
      cell.update(to_json(cells[i]));
      json["cells"].push_back(cell);
    }
    fmt::print("{}\n", json.dump(2));
    return kExitOk;
  }
  fmt::print("{}: {}\n", plan.base.experiment.name, line(sum(cells)));
  if (!holder.empty()) fmt::print("being written by {}\n", holder);
  print_unfinished(stdout, plan, cells);
  for (const std::string& text : state.damaged) fmt::print("damaged: {}\n", text);
  for (const std::string& text : state.conflicts) fmt::print("conflict: {}\n", text);
  return kExitOk;
}

int merge(const MergeOptions& options) {
  const Plan plan = read_manifest(options.out / "manifest.json");
  const FolderLock lock(options.out, LockKind::kAlone, options.wait);
  const SweepState state = read_state(plan, options.out);
  require_sound(state);
  const std::vector<Tally> cells = tally(plan, state);
  if (sum(cells).missing > 0) {
    fmt::print(stderr, "plumbline: {}: nothing is merged while runs are missing: {}\n", options.out.generic_string(),
               line(sum(cells)));
    print_unfinished(stderr, plan, cells);
    return kExitInternal;
  }
  publish(state, options.out);
  return conclude(plan, options.out, options.json ? SummaryOutput::kJson : SummaryOutput::kTable);
}

}  // namespace plumbline::tools
