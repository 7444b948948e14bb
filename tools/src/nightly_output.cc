#include "nightly_output.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>

#include <fmt/format.h>

#include "cell_series.h"
#include "eval/metrics.h"
#include "eval/statistics.h"
#include "markup.h"

namespace plumbline::tools {
namespace {

using nlohmann::ordered_json;

std::string_view word(eval::GateVerdict verdict) { return eval::kGateVerdictNames[static_cast<std::size_t>(verdict)]; }

std::string_view word(eval::GateKind kind) { return eval::kGateKindNames[static_cast<std::size_t>(kind)]; }

std::string title(const eval::Gate& gate) {
  switch (gate.kind) {
    case eval::GateKind::kIdentity:
    case eval::GateKind::kFailures:
      return std::string(word(gate.kind));
    case eval::GateKind::kMetric:
      return gate.name;
    case eval::GateKind::kConsistency:
      return "NEES of " + gate.name;
  }
  return gate.name;
}

std::string ratio_text(const eval::MetricComparison& m) {
  const std::string_view label = eval::metric_info(m.name).label;
  return fmt::format("{} is {:.3f} times the baseline's{}", label.substr(0, label.find(" [")), m.ratio,
                     m.ratio_ci95 ? fmt::format(" [{:.3f}, {:.3f}]", m.ratio_ci95->lo, m.ratio_ci95->hi) : "");
}

bool is_compared(const eval::Gate& gate) {
  return gate.kind != eval::GateKind::kConsistency && gate.verdict != eval::GateVerdict::kNotCompared;
}

std::ptrdiff_t count(const Night& night, eval::GateVerdict verdict) {
  return std::ranges::count(night.gates, verdict, &eval::Gate::verdict);
}

std::string where(const std::string& experiment, const ordered_json& axes) {
  return axes.empty() ? experiment : fmt::format("{} {}", experiment, axes.dump());
}

std::string night_name(const Night& night) {
  return fmt::format("night {} of {}, {}", night.id, night.started, night.commit);
}

// Empty where the gate points at no trial.
std::string replay(const NightReport& report, const eval::Gate& gate) {
  if (!gate.trial) return "";
  int number = 0;
  for (const NightCell& cell : report.night.cells) {
    if (cell.experiment != gate.experiment) continue;
    if (cell.axes == gate.axes) {
      return fmt::format("plumbline replay {} {} {}", (report.out / gate.experiment).generic_string(), number,
                         *gate.trial);
    }
    ++number;
  }
  return "";
}

ordered_json gate_json(const NightReport& report, const eval::Gate& gate) {
  ordered_json json = {
      {"experiment", gate.experiment}, {"axes", gate.axes},       {"kind", word(gate.kind)},       {"name", gate.name},
      {"verdict", word(gate.verdict)}, {"message", gate.message}, {"replay", replay(report, gate)}};
  if (!gate.comparison) return json;
  const eval::MetricComparison& m = *gate.comparison;
  json["rmse_a"] = rounded(m.rmse_a);
  json["rmse_b"] = rounded(m.rmse_b);
  json["ratio"] = rounded(m.ratio);
  if (m.ratio_ci95) json["ci95"] = {rounded(m.ratio_ci95->lo), rounded(m.ratio_ci95->hi)};
  json["p"] = rounded(m.p_holm);
  if (m.detectable_ratio) json["detectable"] = rounded(*m.detectable_ratio);
  return json;
}

const double* value_of(const eval::Row& row, const std::string& name) {
  const auto at = std::ranges::find(row.metrics, name, &eval::Metric::name);
  return row.ok && at != row.metrics.end() ? &at->value : nullptr;
}

// {"trial": [...], "baseline": [...], "tonight": [...]} of the trials that are ok in both.
ordered_json pairs_json(const NightCell& tonight, const NightCell& baseline, const std::string& metric) {
  ordered_json json = {
      {"trial", ordered_json::array()}, {"baseline", ordered_json::array()}, {"tonight", ordered_json::array()}};
  for (const eval::Row& row : tonight.fixed) {
    const auto other = std::ranges::find_if(
        baseline.fixed, [&](const eval::Row& r) { return r.trial == row.trial && r.seed == row.seed; });
    if (other == baseline.fixed.end()) continue;
    const double* a = value_of(*other, metric);
    const double* b = value_of(row, metric);
    if (a == nullptr || b == nullptr) continue;
    json["trial"].push_back(row.trial);
    json["baseline"].push_back(rounded(std::abs(*a)));
    json["tonight"].push_back(rounded(std::abs(*b)));
  }
  return json;
}

ordered_json cells_json(const NightReport& report) {
  ordered_json json = ordered_json::array();
  for (const NightCell& cell : report.night.cells) {
    ordered_json entry = {{"experiment", cell.experiment},
                          {"axes", cell.axes},
                          {"n", cell.fixed.size()},
                          {"n_ok", std::ranges::count(cell.fixed, true, &eval::Row::ok)},
                          {"n_fresh", cell.fresh.size()},
                          {"median_s", cell.estimate_s.empty() ? 0.0 : rounded(eval::median(cell.estimate_s))},
                          {"report", cell.experiment + "/report.html"},
                          {"pairs", ordered_json::object()}};
    if (const NightCell* before = find_partner(report.baseline, cell, report.across_scenarios)) {
      for (const std::string& metric : report.metrics) entry["pairs"][metric] = pairs_json(cell, *before, metric);
    }
    json.push_back(std::move(entry));
  }
  return json;
}

ordered_json trends_json(const NightReport& report) {
  ordered_json json = ordered_json::array();
  for (const TrendPoint& p : report.trends) {
    if (std::ranges::find(report.metrics, p.metric) == report.metrics.end()) continue;
    json.push_back({{"night", p.night},
                    {"started", p.started},
                    {"commit", p.commit},
                    {"red", p.red},
                    {"experiment", p.experiment},
                    {"axes", ordered_json::parse(p.axes)},
                    {"metric", p.metric},
                    {"rmse", rounded(p.rmse)},
                    {"n", p.n}});
  }
  return json;
}

}  // namespace

const NightCell* find_partner(const std::optional<Night>& baseline, const NightCell& cell, bool across_scenarios) {
  if (!baseline) return nullptr;
  const auto at = std::ranges::find_if(baseline->cells, [&](const NightCell& other) {
    return other.experiment == cell.experiment && other.axes == cell.axes &&
           (across_scenarios || other.pairing_hash == cell.pairing_hash);
  });
  return at == baseline->cells.end() ? nullptr : &*at;
}

std::string night_headline(const NightReport& report) {
  const Night& night = report.night;
  const auto red = count(night, eval::GateVerdict::kRed);
  if (red > 0) return fmt::format("Worse than the baseline: {} of {} gates are red", red, night.gates.size());
  if (!report.baseline) return "No baseline yet: this night becomes one";
  if (std::ranges::none_of(night.gates, is_compared)) return "Nothing is compared: no scenario is the baseline's";
  if (count(night, eval::GateVerdict::kUnchanged) == static_cast<std::ptrdiff_t>(night.cells.size())) {
    return "Unchanged: every figure is the baseline's, to the bit";
  }
  return "Not worse than the baseline";
}

std::vector<std::string> night_findings(const NightReport& report) {
  const Night& night = report.night;
  std::vector<std::string> findings;
  constexpr int kTold = 6;
  int told = 0;
  if (report.baseline) findings.push_back(fmt::format("Baseline: {}.", night_name(*report.baseline)));
  for (const eval::Gate& gate : night.gates) {
    if (gate.verdict != eval::GateVerdict::kRed && gate.verdict != eval::GateVerdict::kBetter) continue;
    if (++told > kTold) continue;
    findings.push_back(fmt::format("{}, {}: {}", word(gate.verdict), where(gate.experiment, gate.axes),
                                   gate.comparison ? ratio_text(*gate.comparison) : gate.message));
  }
  if (told > kTold) findings.push_back(fmt::format("and {} more", told - kTold));
  for (const RuntimeChange& change : report.runtime) {
    if (!change.slower) continue;
    findings.push_back(fmt::format("slower, {}: {:.3g} s a trial, {:.3g} s in the baseline (no reason for red)",
                                   where(change.experiment, change.axes), change.median_s, change.baseline_s));
  }
  return findings;
}

std::string junit_xml(const NightReport& report) {
  std::string text = fmt::format(
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites>\n<testsuite name=\"plumbline nightly\" tests=\"{}\" "
      "failures=\"{}\" skipped=\"{}\" timestamp=\"{}\">\n",
      report.night.gates.size(), count(report.night, eval::GateVerdict::kRed),
      count(report.night, eval::GateVerdict::kNotCompared), escape_markup(report.night.started));
  for (const eval::Gate& gate : report.night.gates) {
    fmt::format_to(std::back_inserter(text), "<testcase classname=\"{}\" name=\"{}\"",
                   escape_markup(where(gate.experiment, gate.axes)), escape_markup(title(gate)));
    const std::string message = escape_markup(gate.message);
    if (gate.verdict == eval::GateVerdict::kRed) {
      fmt::format_to(std::back_inserter(text),
                     ">\n<failure message=\"{}\">{}\nbaseline: {}\n{}\n</failure>\n</testcase>\n", message, message,
                     report.baseline ? escape_markup(night_name(*report.baseline)) : "none",
                     escape_markup(replay(report, gate)));
    } else if (gate.verdict == eval::GateVerdict::kNotCompared) {
      fmt::format_to(std::back_inserter(text), "><skipped message=\"{}\"/></testcase>\n", message);
    } else {
      fmt::format_to(std::back_inserter(text), "><system-out>{}</system-out></testcase>\n", message);
    }
  }
  return text + "</testsuite>\n</testsuites>\n";
}

std::string night_markdown(const NightReport& report) {
  std::string text = fmt::format("# Nightly: {}\n\n{}\n\n", night_headline(report), night_name(report.night));
  for (const std::string& finding : night_findings(report)) text += fmt::format("- {}\n", finding);
  text += "\n| experiment | gate | verdict | figures |\n|---|---|---|---|\n";
  for (const eval::Gate& gate : report.night.gates) {
    std::string message = gate.message;
    for (std::size_t at = 0; (at = message.find('|', at)) != std::string::npos; at += 2) message.replace(at, 1, "\\|");
    const std::string command = gate.verdict == eval::GateVerdict::kRed ? replay(report, gate) : "";
    fmt::format_to(std::back_inserter(text), "| {} | {} | {} | {}{} |\n", where(gate.experiment, gate.axes),
                   title(gate), word(gate.verdict), message, command.empty() ? "" : fmt::format("; `{}`", command));
  }
  return text;
}

ordered_json night_data(const NightReport& report) {
  const Night& night = report.night;
  const bool attention = std::ranges::any_of(report.runtime, &RuntimeChange::slower);
  ordered_json json = {{"kind", "nightly"},
                       {"name", fmt::format("Nightly {}", night.started.substr(0, 10))},
                       {"subtitle", fmt::format("{}{}", night_name(night), night.quick ? ", quick" : "")},
                       {"verdict",
                        {{"level", night.red   ? "failed"
                                   : attention ? "attention"
                                               : "ok"},
                         {"headline", night_headline(report)},
                         {"findings", night_findings(report)}}},
                       {"baseline", report.baseline ? ordered_json(report.baseline->id) : ordered_json(nullptr)},
                       {"metrics", ordered_json::array()},
                       {"gates", ordered_json::array()},
                       {"cells", cells_json(report)},
                       {"trends", trends_json(report)},
                       {"runtime", ordered_json::array()},
                       {"provenance", ordered_json::array()}};
  for (const std::string& name : report.metrics) {
    const eval::MetricInfo info = eval::metric_info(name);
    json["metrics"].push_back({{"name", name}, {"label", info.label}, {"scale", info.table_unit}});
  }
  for (const eval::Gate& gate : night.gates) json["gates"].push_back(gate_json(report, gate));
  for (const RuntimeChange& r : report.runtime) {
    json["runtime"].push_back({{"experiment", r.experiment},
                               {"axes", r.axes},
                               {"median_s", rounded(r.median_s)},
                               {"baseline_s", rounded(r.baseline_s)},
                               {"ratio", rounded(r.ratio)},
                               {"slower", r.slower}});
  }
  for (const auto& [name, value] : night.provenance) json["provenance"].push_back({name, value});
  return json;
}

}  // namespace plumbline::tools
