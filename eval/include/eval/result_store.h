// results.jsonl: one line a run, in the order of the runs, the same bytes whatever machine load, threads or shards.
//   {"run_id", "cell", "trial", "seed", "ok", "status", "reason", "metrics": {NAME: {"value", "nees", "nees_dof",
//   "crlb"}},
//    "solver": {"iterations", "final_cost", "cost_per_dof", "observations", "landmarks"}}
// nees and nees_dof are there only where a NEES is, "censored": true only where it holds. Doubles are written so that
// they read back to the last bit. What is not finite is null, which only the solver's figures of a failed run may be.
// No wall-clock figures.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "eval/evaluate.h"
#include "eval/metrics.h"

namespace plumbline::eval {

struct Row {
  std::string run_id;
  int cell = 0;
  int trial = 0;
  std::uint64_t seed = 0;
  bool ok = false;
  std::string status;
  std::string reason;
  std::vector<Metric> metrics;
  SolverFigures solver;
};

// The identity of `row` with the outcome of a trial (all but its series).
Row with_result(Row row, const TrialResult& result);

// Without the line's end. Throws std::logic_error where an ok row holds a value that is not finite.
std::string to_line(const Row& row);

// Strict: a missing, unknown or mistyped key throws core::DataError `where: rule`.
Row parse_row(std::string_view line, const std::string& where);

// Calls `use` for each row in turn, so that a file of any length passes through. Throws core::DataError
// `file:line: rule`, also for a file that is missing and a last line without its end.
void for_each_row(const std::filesystem::path& path, const std::function<void(const Row&)>& use);

}  // namespace plumbline::eval
