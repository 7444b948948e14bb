// Takes what became of trials to the folder of their sweep and to the eyes of the user: first the series, then the line
// in the journal by which the run is complete.
#pragma once

#include <filesystem>
#include <string>

#include "eval/progress.h"
#include "eval/runner.h"
#include "tools/sweep.h"
#include "tools/sweep_folder.h"

namespace plumbline::tools {

// The text by which a trial answers: lines of timings and row, then the series, if there is one.
std::string to_answer(const Finished& finished);

class Recorder {
 public:
  Recorder(const Plan& plan, const std::filesystem::path& out, Journal& journal, const SweepState& before);

  void add(const eval::TrialEnd& end);

  const eval::ProgressCounts& counts() const { return counts_; }

 private:
  void add_row(const eval::Row& row);
  void add_incident(const eval::TrialEnd& end);
  void tell(const eval::Row& row, const std::string& what);

  const Plan& plan_;
  const std::filesystem::path& out_;
  Journal& journal_;
  eval::Progress progress_;
  eval::ProgressCounts counts_;
  double worst_m_ = -1.0;
  int told_ = 0;
};

}  // namespace plumbline::tools
