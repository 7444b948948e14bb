#include "report_data.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "cell_series.h"
#include "core/resolved_config.h"
#include "eval/metrics.h"
#include "eval/result_store.h"
#include "eval/statistics.h"
#include "eval/verdict.h"
#include "provenance.h"
#include "results_folder.h"
#include "tools/sweep.h"

namespace plumbline::tools {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

constexpr std::size_t kWorstOfAMetric = 5;
constexpr std::size_t kListedFailures = 50;
constexpr std::array<const char*, 3> kRankedMetrics = {"td_error_s", "ate_position_m", "ate_rotation_deg"};
constexpr std::array<const char*, 3> kTimedParts = {"simulate_s", "estimate_s", "evaluate_s"};

using CellTimings = std::array<std::vector<double>, 3>;  // of kTimedParts, all trials

// Over the trials of one cell that are ok.
struct CellValues {
  std::vector<std::string> names;
  std::vector<std::vector<double>> values;  // a list a name
  std::vector<std::string> run_ids;

  const std::vector<double>* find(std::string_view name) const {
    const auto at = std::ranges::find(names, name);
    return at == names.end() ? nullptr : &values[static_cast<std::size_t>(at - names.begin())];
  }
};

struct Ranked {
  double size = 0.0;
  ordered_json json;
};

// All that is gathered in one pass over the rows, which come by cell: no more than the figures of one are held.
struct Gathered {
  ordered_json cells = ordered_json::array();
  std::set<std::string> names;
  std::array<std::vector<Ranked>, 3> worst;  // of kRankedMetrics, at most kWorstOfAMetric, largest first
  ordered_json failures = ordered_json::array();
  ordered_json trials = nullptr;
};

void rank(std::vector<Ranked>& list, double size, const ordered_json& json) {
  const auto at = std::ranges::find_if(list, [&](const Ranked& r) { return r.size < size; });
  if (at == list.end() && list.size() >= kWorstOfAMetric) return;
  list.insert(at, {size, json});
  if (list.size() > kWorstOfAMetric) list.pop_back();
}

void add_values(CellValues& cell, const eval::Row& row) {
  cell.run_ids.push_back(row.run_id);
  for (const eval::Metric& m : row.metrics) {
    auto at = static_cast<std::size_t>(std::ranges::find(cell.names, m.name) - cell.names.begin());
    if (at == cell.names.size()) {
      cell.names.push_back(m.name);
      cell.values.emplace_back();
    }
    cell.values[at].push_back(m.value);
  }
}

void add_trial(ordered_json& trials, const eval::Row& row) {
  trials["cell"].push_back(row.cell);
  trials["trial"].push_back(row.trial);
  trials["ok"].push_back(row.ok);
  trials["status"].push_back(row.status);
  trials["run_id"].push_back(row.run_id);
  trials["iterations"].push_back(row.solver.iterations);
  ordered_json metrics = ordered_json::object();
  for (const eval::Metric& m : row.metrics) {
    if (eval::metric_info(m.name).in_table || m.name == eval::kTdConvergence) metrics[m.name] = rounded(m.value);
  }
  trials["metrics"].push_back(std::move(metrics));
}

void add_failure(Gathered& gathered, const eval::Row& row, ordered_json where) {
  if (gathered.failures.size() >= kListedFailures) return;
  where["status"] = row.status;
  where["reason"] = row.reason;
  gathered.failures.push_back(std::move(where));
}

void rank_errors(Gathered& gathered, const eval::Row& row, const ordered_json& where) {
  for (const eval::Metric& m : row.metrics) {
    const auto at = std::ranges::find(kRankedMetrics, std::string_view(m.name));
    if (at == kRankedMetrics.end()) continue;
    ordered_json json = where;
    json["metric"] = m.name;
    json["value"] = rounded(m.value);
    rank(gathered.worst[static_cast<std::size_t>(at - kRankedMetrics.begin())], std::abs(m.value), json);
  }
}

std::vector<CellTimings> read_timings(const fs::path& out, std::size_t cells) {
  std::vector<CellTimings> timings(cells);
  std::ifstream file(out / "timings.jsonl", std::ios::binary);
  for (std::string line; std::getline(file, line);) {
    const ordered_json json = ordered_json::parse(line);
    CellTimings& cell = timings.at(json.at("cell").get<std::size_t>());
    for (std::size_t i = 0; i < kTimedParts.size(); ++i) cell[i].push_back(json.at(kTimedParts[i]).get<double>());
  }
  return timings;
}

ordered_json quantiles(std::vector<double> values, const std::vector<double>& levels) {
  std::ranges::sort(values);  // once for all levels
  ordered_json json = ordered_json::array();
  for (const double p : levels) json.push_back(rounded(eval::quantile(values, p)));
  return json;
}

ordered_json ecdfs(const CellValues& cell) {
  std::vector<double> levels;
  for (int i = 0; i <= 100; ++i) levels.push_back(0.01 * i);
  ordered_json json = ordered_json::object();
  for (std::size_t i = 0; i < cell.names.size(); ++i) {
    if (eval::metric_info(cell.names[i]).in_table) json[cell.names[i]] = quantiles(cell.values[i], levels);
  }
  return json;
}

ordered_json timing_json(const CellTimings& timings) {
  ordered_json json = ordered_json::object();
  for (std::size_t i = 0; i < kTimedParts.size(); ++i) {
    const std::vector<double>& values = timings[i];
    if (values.empty()) continue;
    json[kTimedParts[i]] = {{"q", quantiles(values, {0.0, 0.05, 0.25, 0.5, 0.75, 0.95, 1.0})},
                            {"sum_s", rounded(eval::mean(values) * static_cast<double>(values.size()))}};
  }
  return json;
}

// The trials with the median and with the largest error of position.
ordered_json paths(const CellValues& cell, const fs::path& out) {
  ordered_json json = ordered_json::object();
  const std::vector<double>* ate = cell.find("ate_position_m");
  if (ate == nullptr || ate->empty()) return json;
  std::vector<std::size_t> order(ate->size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::ranges::sort(order, [&](std::size_t a, std::size_t b) { return (*ate)[a] < (*ate)[b]; });
  for (const auto& [name, at] :
       {std::pair{"median", order[(order.size() - 1) / 2]}, std::pair{"worst", order.back()}}) {
    ordered_json path = path_of(out, cell.run_ids[at]);
    if (path.is_null()) continue;
    path["run_id"] = cell.run_ids[at];
    path["ate_position_m"] = rounded((*ate)[at]);
    json[name] = std::move(path);
  }
  return json;
}

ordered_json cell_json(const Cell& cell, const eval::CellSummary& summary, const CellValues& values,
                       const CellTimings& timings, const fs::path& out, bool detailed) {
  ordered_json json = eval::to_json(summary);
  for (auto& metric : json.at("metrics")) {
    for (auto& figure : metric) {
      if (figure.is_number_float()) figure = rounded(figure.get<double>());
      if (figure.is_array()) figure = rounded(figure.get<std::vector<double>>());
    }
  }
  json["config_hash"] = cell.config_hash;
  json["td_s"] = cell.experiment.scenario.camera.td_s;
  json["ecdf"] = ecdfs(values);
  json["timing"] = timing_json(timings);
  if (!detailed) return json;
  std::vector<std::string> run_ids = values.run_ids;
  if (run_ids.size() > kSeriesOfACell) run_ids.resize(kSeriesOfACell);
  json.update(series_bands(out, run_ids));
  json["paths"] = paths(values, out);
  return json;
}

Gathered gather(const Plan& plan, const fs::path& out, const std::vector<eval::CellSummary>& summaries) {
  Gathered gathered;
  const bool list_trials = plan.runs() <= kListedTrials;
  if (list_trials) gathered.trials = ordered_json::object();
  const std::vector<CellTimings> timings = read_timings(out, plan.cells.size());
  CellValues values;
  const auto close_cell = [&] {
    const std::size_t c = gathered.cells.size();
    gathered.names.insert(values.names.begin(), values.names.end());
    gathered.cells.push_back(
        cell_json(plan.cells[c], summaries[c], values, timings[c], out, static_cast<int>(c) < kDetailedCells));
    values = {};
  };
  for_each_result(out, plan.cells.size(), [&](const eval::Row& row) {
    while (gathered.cells.size() < static_cast<std::size_t>(row.cell)) close_cell();
    if (list_trials) add_trial(gathered.trials, row);
    const ordered_json where = {{"cell", row.cell}, {"trial", row.trial}, {"replay", replay_command(out, row)}};
    if (!row.ok) return add_failure(gathered, row, where);
    add_values(values, row);
    rank_errors(gathered, row, where);
  });
  while (gathered.cells.size() < plan.cells.size()) close_cell();
  return gathered;
}

ordered_json metrics_json(const std::set<std::string>& names) {
  ordered_json json = ordered_json::array();
  for (const eval::MetricInfo& info : eval::kMetrics) {
    if (!names.contains(std::string(info.name))) continue;
    json.push_back({{"name", info.name},
                    {"label", info.label},
                    {"scale", info.table_unit},
                    {"signed", info.is_signed},
                    {"in_table", info.in_table}});
  }
  return json;
}

ordered_json provenance_json(const Plan& plan, const fs::path& out) {
  ordered_json json = ordered_json::array();
  const ordered_json summary = ordered_json::parse(std::ifstream(out / "summary.json"), nullptr, false);
  json.push_back({"Experiment", plan.base.experiment.name});
  json.push_back({"Configuration", fmt::format("hash {}; the first cell's is below, whole", plan.config_hash)});
  json.push_back(
      {"Seeds", fmt::format("experiment.seed {}, trials 0 to {} of each of {} cells; a trial's noise depends "
                            "on both alone",
                            plan.base.experiment.seed, plan.base.experiment.trials - 1, plan.cells.size())});
  if (summary.is_object()) json.push_back({"Summarised by", summary.value("git", "unknown")});
  for (const auto& [name, text] : provenance()) json.push_back({name + " (this report)", text});
  return json;
}

}  // namespace

ordered_json report_data(const Plan& plan, const fs::path& out, const std::vector<eval::CellSummary>& cells) {
  Gathered gathered = gather(plan, out, cells);
  Experiment first = plan.cells.front().experiment;
  first.experiment = plan.base.experiment;  // with its name
  const eval::Verdict verdict = eval::judge(cells, plan.base.experiment.max_failed_share);
  ordered_json worst = ordered_json::array();
  for (auto& list : gathered.worst) {
    for (Ranked& ranked : list) worst.push_back(std::move(ranked.json));
  }
  return {{"kind", "sweep"},
          {"name", plan.base.experiment.name},
          {"verdict",
           {{"level", eval::kVerdictLevelNames[static_cast<std::size_t>(verdict.level)]},
            {"headline", verdict.headline},
            {"findings", verdict.findings}}},
          {"metrics", metrics_json(gathered.names)},
          {"cells", std::move(gathered.cells)},
          {"trials", std::move(gathered.trials)},
          {"worst", std::move(worst)},
          {"failures", std::move(gathered.failures)},
          {"provenance", provenance_json(plan, out)},
          {"config", core::resolved_config(first)}};
}

}  // namespace plumbline::tools
