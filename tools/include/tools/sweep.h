// A sweep: the runs of a plan in a folder (tools/sweep_folder.h), by whichever launcher.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "eval/evaluate.h"
#include "eval/runner.h"
#include "eval/summary.h"
#include "tools/commands.h"
#include "tools/experiment.h"
#include "tools/run_trial.h"
#include "tools/sweep_folder.h"

namespace plumbline::tools {

// run_trial, or in tests one that breaks.
using TrialFunction = std::function<eval::TrialResult(const Experiment&, core::TrialId, TrialTimings*)>;

int run(const RunOptions& options, const TrialFunction& trial);
int replay(const ReplayOptions& options, const TrialFunction& trial);

// What became of a run, for the files.
struct Finished {
  eval::Row row;
  std::string series;  // JSON and a line's end; empty where the run is not ok
  TrialTimings timings;
};

// Throws what the trial throws.
Finished run_one(const Plan& plan, int index, const TrialFunction& trial);

// The row of a trial that ended by its own fault.
eval::Row failed_row(const Plan& plan, int index, const eval::TrialEnd& end);

// Of a published sweep, cell by cell, so that no more than the rows of one are held.
std::vector<eval::CellSummary> summarise_cells(const Plan& plan, const std::filesystem::path& out);

// Of a published sweep: writes summary.json where it is not as it should be and report.html, prints the summary, and
// returns the exit code.
int conclude(const Plan& plan, const std::filesystem::path& out, SummaryOutput output);

// To Slurm, in shards: what is missing, each run about trial_s of work.
int submit(const Plan& plan, const std::filesystem::path& out, const RunOptions& options, const SweepState& state,
           double trial_s);

// `plumbline replay OUT CELL TRIAL`
std::string replay_command(const std::filesystem::path& out, const eval::Row& row);

}  // namespace plumbline::tools
