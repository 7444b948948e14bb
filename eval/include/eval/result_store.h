// results.jsonl: one line a run, in the order of the runs, the same bytes whatever machine load, threads or shards.
//   {"run_id", "cell", "trial", "seed", "ok", "status", "reason", "metrics": {NAME: {"value", "nees", "nees_dof"}},
//    "solver": {"iterations", "final_cost", "cost_per_dof", "observations", "landmarks"}}
// nees and nees_dof are there only where a NEES is, "censored": true only where it holds. Doubles are written so that
// they read back to the last bit. What is not finite is null, which only the solver's figures of a failed run may be.
// No wall-clock figures.
#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <mutex>
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

enum class Tail {
  kWhole,    // every line must be complete
  kMayTear,  // a last line without its end, of a writer that was killed, is left out
};

// Calls `use` for each row in turn, so that a file of any length passes through. Throws core::DataError
// `file:line: rule`, also for a file that is missing.
void for_each_row(const std::filesystem::path& path, Tail tail, const std::function<void(const Row&)>& use);

// Writes rows that come in any order, from any thread, in the order of their indices 0, 1, 2, ..., each as soon as all
// before it are there. Until finish() the file is PATH.tmp, always a prefix of the result (Tail::kMayTear reads it).
class ResultWriter {
 public:
  explicit ResultWriter(std::filesystem::path path);  // PATH.tmp is begun anew

  void add(int index, const Row& row);  // each index once

  // Syncs and renames PATH.tmp to PATH. Throws std::logic_error where rows still wait for one that never came.
  void finish();

 private:
  std::filesystem::path path_;
  std::mutex mutex_;
  std::ofstream file_;
  int next_ = 0;
  std::map<int, std::string> waiting_;
};

}  // namespace plumbline::eval
