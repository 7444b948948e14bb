#include <fmt/format.h>

#include "core/atomic_file.h"
#include "core/error.h"
#include "eval/summary_table.h"
#include "eval/verdict.h"
#include "report_data.h"
#include "tools/commands.h"
#include "tools/report.h"
#include "tools/sweep.h"

namespace plumbline::tools {
namespace {

namespace fs = std::filesystem;

std::string markdown(const Plan& plan, const std::vector<eval::CellSummary>& cells) {
  const eval::Verdict verdict = eval::judge(cells, plan.base.experiment.max_failed_share);
  std::string text = fmt::format("# {}\n\n**{}.**\n\n", plan.base.experiment.name, verdict.headline);
  for (const std::string& finding : verdict.findings) text += fmt::format("- {}\n", finding);
  return text + "\n" + eval::summary_markdown(cells);
}

}  // namespace

void write_report(const Plan& plan, const fs::path& out, const std::vector<eval::CellSummary>& cells,
                  const fs::path& file) {
  core::write_file_if_changed(file, report_page(plan.base.experiment.name, report_data(plan, out, cells)));
}

int report(const ReportOptions& options) {
  const fs::path& out = options.results;
  const Plan plan = read_manifest(out / "manifest.json");
  if (!fs::exists(out / "results.jsonl")) {
    throw core::DataError(fmt::format("{}: no results yet; to make them: plumbline run {}",
                                      (out / "results.jsonl").generic_string(), out.generic_string()));
  }
  const std::vector<eval::CellSummary> cells = summarise_cells(plan, out);
  if (options.format == ReportFormat::kHtml) {
    const fs::path file = options.out.value_or(out / kReportFile);
    write_report(plan, out, cells, file);
    fmt::print("{}\n", file.generic_string());
  } else if (options.out) {
    core::write_file_atomically(*options.out, markdown(plan, cells));
  } else {
    fmt::print("{}", markdown(plan, cells));
  }
  return kExitOk;
}

}  // namespace plumbline::tools
