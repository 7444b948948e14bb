// The folder of a sweep, while it runs and after:
//   manifest.json     the plan
//   shards/*.jsonl    what is done so far in any order: journals of running and killed programs, and finished shards
//   results.jsonl, timings.jsonl, incidents.jsonl   the same in the order of the plan, once nothing is missing
//   series/ID.json    of each run that is ok
// A line of any .jsonl is one record of one run: its row (eval/result_store.h), its timings, or an incident:
//   {"run_id", "cell", "trial", "simulate_s", "estimate_s", "evaluate_s"}
//   {"run_id", "cell", "trial", "seed", "cause", "replay"}
// A run is complete once its row is there; it has an incident where the machine took it before. Whoever writes, writes
// a series before its row, so that at any instant a program can be killed and another one go on from what is there.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "eval/result_store.h"
#include "tools/experiment.h"
#include "tools/run_trial.h"

namespace plumbline::tools {

// The row of a run, without its outcome. Runs are numbered by cell, then trial.
eval::Row identity(const Plan& plan, int index);

std::string timings_line(const eval::Row& row, const TrialTimings& timings);
std::string incident_line(const eval::Row& row, const std::string& cause, const std::string& replay);

// Where a record stands.
struct Place {
  std::int32_t file = -1;  // of SweepState::files
  std::uint32_t size = 0;  // without the line's end
  std::int64_t offset = 0;

  explicit operator bool() const { return file >= 0; }
};

struct RunState {
  Place row;
  Place timings;
  Place incident;
  bool ok = false;
};

struct SweepState {
  std::vector<std::filesystem::path> files;
  std::vector<RunState> runs;
  // One line each: what cannot be read and counts as missing; what no one can decide but the user.
  std::vector<std::string> damaged;
  std::vector<std::string> conflicts;

  std::string read(const Place& place) const;
  std::vector<int> incomplete() const;
  bool has_journals() const;  // something in shards/
};

// Reads all records but keeps only where they stand. The last line of a file in shards/ may be torn. A row of an ok run
// without its whole series, as a power cut may leave it, is damaged; two rows of one run that differ, and one of
// another plan, are conflicts.
SweepState read_state(const Plan& plan, const std::filesystem::path& out);

// Throws core::DataError with the conflicts; prints what is damaged to stderr.
void require_sound(const SweepState& state);

// results.jsonl, timings.jsonl and incidents.jsonl in the order of the plan, all of it on the disk before the rows are
// renamed to their place; then shards/ is emptied.
void publish(const SweepState& state, const std::filesystem::path& out);

// Lines are appended by one write each. The file is the program's own, shards/NAME-HOST-PID-K.jsonl.
class Journal {
 public:
  Journal(const std::filesystem::path& out, const std::string& name);
  ~Journal();
  Journal(const Journal&) = delete;
  Journal& operator=(const Journal&) = delete;

  void append(std::string_view lines);
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
  int file_ = -1;
};

// The records of the runs that `belongs` picks, and what `file` held already, as that file; the journal is removed.
void publish_shard(const SweepState& state, const Journal& journal, const std::filesystem::path& file,
                   const std::function<bool(int index)>& belongs);

}  // namespace plumbline::tools
