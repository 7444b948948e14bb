#include <algorithm>
#include <chrono>
#include <cmath>
#include <ctime>
#include <fstream>
#include <map>

#include <fmt/chrono.h>
#include <fmt/format.h>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/hash.h"
#include "core/resolved_config.h"
#include "eval/signed_rank.h"
#include "eval/statistics.h"
#include "nightly_output.h"
#include "nightly_suite.h"
#include "provenance.h"
#include "results_folder.h"
#include "tools/commands.h"
#include "tools/history.h"
#include "tools/report.h"
#include "tools/sweep.h"
#include "tools/version.h"

namespace plumbline::tools {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

constexpr int kTrendNights = 60;
constexpr double kRuntimeAlpha = 0.001;  // of being called slower by chance

// What may differ between nights whose trials are paired is the estimator alone.
std::string pairing_hash(const Experiment& e) {
  const ordered_json content = {{"seed", e.experiment.seed},
                                {"scenario", core::resolved_config(e.scenario, core::PathForm::kContentHash)},
                                {"eval", core::resolved_config(e.metrics, core::PathForm::kContentHash)}};
  return core::content_hash(content.dump());
}

// A cell a row of the plan in a folder of results; the metrics of each row by name, as a history gives them back.
std::vector<NightCell> read_night_cells(const Plan& plan, const fs::path& out) {
  std::vector<NightCell> cells;
  cells.reserve(plan.cells.size());
  for (const Cell& cell : plan.cells) {
    cells.push_back({.experiment = plan.base.experiment.name,
                     .axes = cell.axes,
                     .config_hash = cell.config_hash,
                     .pairing_hash = pairing_hash(cell.experiment),
                     .config = core::resolved_config(cell.experiment),
                     .fixed = {},
                     .fresh = {},
                     .estimate_s = {}});
  }
  for_each_result(out, cells.size(), [&](const eval::Row& row) {
    eval::Row sorted = row;
    std::ranges::sort(sorted.metrics, {}, &eval::Metric::name);
    cells[static_cast<std::size_t>(row.cell)].fixed.push_back(std::move(sorted));
  });
  std::ifstream timings(out / "timings.jsonl", std::ios::binary);
  for (std::string line; std::getline(timings, line);) {
    const ordered_json json = ordered_json::parse(line);
    cells.at(json.at("cell").get<std::size_t>()).estimate_s.push_back(json.at("estimate_s").get<double>());
  }
  return cells;
}

// An experiment with so many trials from that seed. Nothing where runs were lost to the machine.
std::vector<NightCell> run_experiment(const fs::path& file, const fs::path& out, int trials, std::uint64_t seed,
                                      const NightlyOptions& nightly) {
  RunOptions options;
  options.experiment = file;
  options.out = out;
  options.trials = trials;
  options.set = nightly.set;
  options.set.push_back(fmt::format("experiment.seed={}", seed));
  options.jobs = nightly.jobs;
  options.output = SummaryOutput::kNone;
  fmt::print(stderr, "plumbline: {}, {} trials from seed {}\n", file.stem().string(), trials, seed);
  if (run(options) == kExitInternal) return {};
  return read_night_cells(read_manifest(out / "manifest.json"), out);
}

bool run_suite(const NightlySuite& suite, const NightlyOptions& options, const fs::path& out, Night& night) {
  const NightlyConfig& rules = suite.rules;
  const int trials = options.quick ? rules.quick_trials : rules.trials;
  const int fresh_trials = options.quick ? std::min(rules.quick_trials, rules.fresh_trials) : rules.fresh_trials;
  for (const fs::path& file : suite.experiments) {
    const std::string name = load_plan(file, {}).base.experiment.name;
    auto cells = run_experiment(file, out / name, trials, rules.seed, options);
    if (cells.empty()) return false;
    if (fresh_trials > 0) {
      auto fresh = run_experiment(file, out / (name + "-fresh"), fresh_trials, night.fresh_seed, options);
      if (fresh.empty()) return false;
      for (std::size_t i = 0; i < cells.size(); ++i) cells[i].fresh = std::move(fresh[i].fixed);
    }
    std::ranges::move(cells, std::back_inserter(night.cells));
  }
  return true;
}

// The rows of `cell` whose trial and seed `other` has as well.
eval::CellOutcomes outcomes(const NightCell& cell, const NightCell& other) {
  eval::CellOutcomes result{.axes = cell.axes, .metrics = {}, .trials = {}};
  for (const eval::Row& row : cell.fixed) {
    const bool shared = std::ranges::any_of(
        other.fixed, [&](const eval::Row& r) { return r.trial == row.trial && r.seed == row.seed; });
    if (shared) result.add(row);
  }
  return result;
}

// Of the metrics that are judged and of `final_state`, where all fresh trials have one.
std::vector<eval::FreshNees> fresh_nees(const NightCell& cell, const std::vector<std::string>& metrics) {
  std::vector<std::string> names = metrics;
  names.emplace_back("final_state");
  std::vector<eval::FreshNees> result;
  for (const std::string& name : names) {
    eval::FreshNees nees{.name = name, .dof = 0, .n = 0, .mean = 0.0};
    for (const eval::Row& row : cell.fresh) {
      const auto at = std::ranges::find(row.metrics, name, &eval::Metric::name);
      if (!row.ok || at == row.metrics.end() || at->nees_dof == 0) continue;
      nees.dof = at->nees_dof;
      nees.mean += at->nees.value_or(0.0);
      ++nees.n;
    }
    if (nees.n == 0 || nees.n < static_cast<int>(cell.fresh.size())) continue;
    nees.mean /= nees.n;
    result.push_back(nees);
  }
  return result;
}

std::vector<eval::JudgedCell> judged_cells(const Night& night, const std::optional<Night>& baseline,
                                           const std::vector<std::string>& metrics, bool across_scenarios) {
  std::vector<eval::JudgedCell> cells;
  for (const NightCell& cell : night.cells) {
    const NightCell* before = find_partner(baseline, cell, across_scenarios);
    eval::JudgedCell judged{.experiment = cell.experiment,
                            .tonight = outcomes(cell, before != nullptr ? *before : cell),
                            .baseline = std::nullopt,
                            .fresh = fresh_nees(cell, metrics),
                            .baseline_fresh = {}};
    if (before != nullptr) {
      judged.baseline = outcomes(*before, cell);
      judged.baseline_fresh = fresh_nees(*before, metrics);
    }
    cells.push_back(std::move(judged));
  }
  return cells;
}

std::vector<RuntimeChange> runtime_changes(const Night& night, const std::optional<Night>& baseline, double limit,
                                           bool across_scenarios) {
  std::vector<RuntimeChange> changes;
  for (const NightCell& cell : night.cells) {
    const NightCell* before = find_partner(baseline, cell, across_scenarios);
    if (before == nullptr) continue;
    const std::size_t n = std::min(cell.estimate_s.size(), before->estimate_s.size());
    std::vector<double> log_ratios;
    log_ratios.reserve(n);
    for (std::size_t i = 0; i < n; ++i) log_ratios.push_back(std::log(cell.estimate_s[i] / before->estimate_s[i]));
    if (log_ratios.empty()) continue;
    const double ratio = std::exp(eval::hodges_lehmann(log_ratios));
    changes.push_back({.experiment = cell.experiment,
                       .axes = cell.axes,
                       .median_s = eval::median(cell.estimate_s),
                       .baseline_s = eval::median(before->estimate_s),
                       .ratio = ratio,
                       .slower = ratio >= limit && eval::signed_rank_p_value(log_ratios) <= kRuntimeAlpha});
  }
  return changes;
}

Night begin_night(const NightlyOptions& options) {
  const std::time_t now = std::chrono::system_clock::to_time_t(std::chrono::system_clock::now());
  Night night;
  night.started = fmt::format("{:%Y-%m-%d %H:%M:%S}", fmt::gmtime(now));
  night.commit = commit();
  night.version = version();
  night.quick = options.quick;
  night.fresh_seed = options.fresh_seed.value_or(static_cast<std::uint64_t>(now));
  night.tag = options.tag;
  night.provenance = provenance();
  return night;
}

// A folder of its own for each night, also for two that begin in the same second.
fs::path make_night_folder(const NightlyOptions& options, const Night& night) {
  if (options.out) {
    if (fs::exists(*options.out) && !fs::is_empty(*options.out)) {
      throw core::DataError(options.out->generic_string() + ": holds something already; choose another --out");
    }
    fs::create_directories(*options.out);
    return *options.out;
  }
  std::string stamp = night.started;
  std::ranges::replace(stamp, ' ', '_');
  std::erase(stamp, ':');
  fs::create_directories("out/nightly");
  for (int k = 0;; ++k) {
    const fs::path folder = fs::path("out/nightly") / (k == 0 ? stamp : fmt::format("{}_{}", stamp, k));
    if (fs::create_directory(folder)) return folder;
  }
}

std::string suite_hash(const NightlySuite& suite, const Night& night) {
  std::string text = core::resolved_config(suite.rules).dump();
  for (const NightCell& cell : night.cells) text += cell.config_hash;
  for (const std::string& metric : suite.metrics) text += metric;
  return core::content_hash(text);
}

void write_outputs(const NightReport& report) {
  core::write_file_atomically(report.out / "junit.xml", junit_xml(report));
  core::write_file_atomically(report.out / "summary.md", night_markdown(report));
  const ordered_json data = night_data(report);
  core::write_file_atomically(report.out / "nightly.html", report_page(data["name"].get<std::string>(), data));
}

}  // namespace

int nightly(const NightlyOptions& options) {
  const NightlySuite suite = load_suite(options.suite);
  History history(options.history);
  const auto baseline_id = history.find(options.baseline, options.quick);
  if (!baseline_id && options.baseline != "last_green") {
    throw core::DataError(fmt::format("--baseline {}: no {}night in {} has this tag or commit", options.baseline,
                                      options.quick ? "quick " : "", options.history.generic_string()));
  }
  NightReport report{.night = begin_night(options),
                     .baseline = {},
                     .runtime = {},
                     .trends = {},
                     .metrics = suite.metrics,
                     .across_scenarios = options.across_scenarios,
                     .out = {}};
  Night& night = report.night;
  report.out = make_night_folder(options, night);
  if (!run_suite(suite, options, report.out, night)) {
    fmt::print(stderr, "plumbline: runs are missing; this night enters no history\n");
    return kExitInternal;
  }
  if (baseline_id) report.baseline = history.load(*baseline_id);
  night.baseline = baseline_id;
  night.suite_hash = suite_hash(suite, night);
  night.gates = eval::judge_night(
      judged_cells(night, report.baseline, suite.metrics, options.across_scenarios),
      {.alpha = suite.rules.alpha, .practical_minimum = suite.rules.practical_minimum, .metrics = suite.metrics});
  night.red = eval::is_red(night.gates);
  report.runtime = runtime_changes(night, report.baseline, suite.rules.runtime_ratio, options.across_scenarios);
  night.id = history.add(night);
  report.trends = history.trends(options.quick, kTrendNights);
  write_outputs(report);
  fmt::print("{}\n", night_headline(report));
  for (const std::string& finding : night_findings(report)) fmt::print("  {}\n", finding);
  fmt::print("report: {}\n", (report.out / "nightly.html").generic_string());
  return night.red ? kExitWorse : kExitOk;
}

}  // namespace plumbline::tools
