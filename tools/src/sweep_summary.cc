#include <cstdio>
#include <fstream>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "core/atomic_file.h"
#include "core/error.h"
#include "eval/summary.h"
#include "eval/summary_table.h"
#include "tools/report.h"
#include "tools/run_trial.h"
#include "tools/sweep.h"
#include "tools/version.h"

namespace plumbline::tools {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

// Mean processor seconds a trial.
ordered_json mean_runtime(const fs::path& out) {
  std::ifstream file(out / "timings.jsonl", std::ios::binary);
  TrialTimings sum;
  int n = 0;
  for (std::string line; std::getline(file, line); ++n) {
    const ordered_json json = ordered_json::parse(line);
    sum.simulate_s += json.at("simulate_s").get<double>();
    sum.estimate_s += json.at("estimate_s").get<double>();
    sum.evaluate_s += json.at("evaluate_s").get<double>();
  }
  const double per = n > 0 ? 1.0 / n : 0.0;
  return {
      {"simulate_s", sum.simulate_s * per}, {"estimate_s", sum.estimate_s * per}, {"evaluate_s", sum.evaluate_s * per}};
}

}  // namespace

std::vector<eval::CellSummary> summarise_cells(const Plan& plan, const fs::path& out) {
  std::vector<eval::CellSummary> summaries;
  std::vector<eval::Row> rows;
  const auto close_cell = [&] {
    const Cell& cell = plan.cells[summaries.size()];
    summaries.push_back(eval::summarise(rows, cell.axes, reason_to_claim_nothing(cell.experiment)));
    rows.clear();
  };
  eval::for_each_row(out / "results.jsonl", [&](const eval::Row& row) {
    while (static_cast<int>(summaries.size()) < row.cell) close_cell();
    rows.push_back(row);
  });
  while (summaries.size() < plan.cells.size()) close_cell();
  return summaries;
}

int conclude(const Plan& plan, const fs::path& out, SummaryOutput output) {
  const std::vector<eval::CellSummary> cells = summarise_cells(plan, out);
  ordered_json json_cells = ordered_json::array();
  int rows = 0;
  int failed = 0;
  for (const eval::CellSummary& cell : cells) {
    json_cells.push_back(eval::to_json(cell));
    rows += cell.n;
    failed += cell.n - cell.n_ok;
  }
  const ordered_json summary = {
      {"experiment", plan.base.experiment.name}, {"git", commit()},     {"config_hash", plan.config_hash},
      {"error", eval::kErrorDefinition},         {"cells", json_cells}, {"runtime_s", mean_runtime(out)}};
  const std::string text = summary.dump(2) + "\n";
  core::write_file_if_changed(out / "summary.json", text);
  write_report(plan, out, cells, out / kReportFile);
  if (output == SummaryOutput::kJson) {
    fmt::print("{}", text);
  } else if (output == SummaryOutput::kTable) {
    fmt::print("{}\nresults: {}\nreport: {}\n", eval::summary_table(cells), out.generic_string(),
               (out / kReportFile).generic_string());
  }
  if (rows < plan.runs()) {
    fmt::print(stderr, "plumbline: {} runs were lost to the machine, see {}; to try them again: plumbline run {}\n",
               plan.runs() - rows, (out / "incidents.jsonl").generic_string(), out.generic_string());
    return kExitInternal;
  }
  return failed > plan.base.experiment.max_failed_share * plan.runs() ? kExitWorse : kExitOk;
}

}  // namespace plumbline::tools
