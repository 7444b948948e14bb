#include "eval/gates.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "eval/metrics.h"
#include "eval/multiple_tests.h"

namespace plumbline::eval {
namespace {

using nlohmann::ordered_json;

bool same_outcomes(const CellOutcomes& a, const CellOutcomes& b) {
  if (a.metrics != b.metrics || a.trials.size() != b.trials.size()) return false;
  return std::ranges::equal(a.trials, b.trials, [](const TrialOutcome& x, const TrialOutcome& y) {
    return x.trial == y.trial && x.seed == y.seed && x.ok == y.ok && x.values == y.values;
  });
}

// The number of the judged cell stands among the axes, so that cells of two experiments with the same axes stay apart.
CellOutcomes numbered(const CellOutcomes& cell, std::size_t number) {
  CellOutcomes copy = cell;
  copy.axes = {{"cell", number}};
  return copy;
}

Gate gate_of(const JudgedCell& cell, GateKind kind, std::string name, GateVerdict verdict, std::string message) {
  return {.experiment = cell.experiment,
          .axes = cell.tonight.axes,
          .kind = kind,
          .name = std::move(name),
          .verdict = verdict,
          .message = std::move(message),
          .comparison = std::nullopt};
}

// Trials of the two stand in the same order, for the comparison has paired them.
std::optional<int> first_new_failure(const CellOutcomes& before, const CellOutcomes& now) {
  for (std::size_t i = 0; i < now.trials.size(); ++i) {
    if (!now.trials[i].ok && before.trials[i].ok) return now.trials[i].trial;
  }
  return std::nullopt;
}

std::optional<int> worst_pair(const CellOutcomes& before, const CellOutcomes& now, const std::string& name) {
  const auto value = [&](const CellOutcomes& outcomes, std::size_t i) {
    const auto at = std::ranges::find(outcomes.metrics, name) - outcomes.metrics.begin();
    return std::abs(outcomes.trials[i].values[static_cast<std::size_t>(at)]);
  };
  std::optional<int> worst;
  double largest = 1.0;
  for (std::size_t i = 0; i < now.trials.size(); ++i) {
    if (!now.trials[i].ok || !before.trials[i].ok) continue;
    const double ratio = value(now, i) / value(before, i);
    if (ratio <= largest) continue;
    largest = ratio;
    worst = now.trials[i].trial;
  }
  return worst;
}

Gate failures_gate(const JudgedCell& cell, const CellOutcomes& before, const CellComparison& c, double level) {
  const bool worse = c.only_b_failed > c.only_a_failed && c.p_failures_holm <= level;
  Gate gate =
      gate_of(cell, GateKind::kFailures, "failures", worse ? GateVerdict::kRed : GateVerdict::kGreen,
              fmt::format("{} of {} trials failed, {} in the baseline; only now {}, only then {}; p = {:.2g}",
                          c.n - c.n_ok_b, c.n, c.n - c.n_ok_a, c.only_b_failed, c.only_a_failed, c.p_failures_holm));
  gate.trial = first_new_failure(before, cell.tonight);
  return gate;
}

Gate metric_gate(const JudgedCell& cell, const CellOutcomes& before, const MetricComparison& m, double level,
                 double minimum) {
  const MetricInfo info = metric_info(m.name);
  const std::string figures = fmt::format("{}: RMSE {:.4g}, baseline {:.4g}, {} pairs", info.label,
                                          m.rmse_b * info.table_unit, m.rmse_a * info.table_unit, m.pairs);
  if (!m.not_compared.empty()) {
    return gate_of(cell, GateKind::kMetric, m.name, GateVerdict::kNotCompared,
                   fmt::format("{}; {}", figures, m.not_compared));
  }
  const bool certain = m.p_holm <= level;
  GateVerdict verdict = GateVerdict::kGreen;
  if (certain && m.ratio >= 1.0 + minimum) verdict = GateVerdict::kRed;
  if (certain && m.ratio <= 1.0 / (1.0 + minimum)) verdict = GateVerdict::kBetter;
  Gate gate = gate_of(
      cell, GateKind::kMetric, m.name, verdict,
      fmt::format(
          "{}; ratio {:.4f}{}, p = {:.2g}{}", figures, m.ratio,
          m.ratio_ci95 ? fmt::format(" [{:.4f}, {:.4f}]", m.ratio_ci95->lo, m.ratio_ci95->hi) : "", m.p_holm,
          m.detectable_ratio ? fmt::format(", found in 4 of 5 nights from {:.3f} on", *m.detectable_ratio) : ""));
  gate.comparison = m;
  gate.trial = worst_pair(before, cell.tonight, m.name);
  return gate;
}

const FreshNees* find_fresh(const std::vector<FreshNees>& list, const std::string& name) {
  const auto at = std::ranges::find(list, name, &FreshNees::name);
  return at == list.end() ? nullptr : &*at;
}

void add_consistency_gates(std::vector<Gate>& gates, const std::vector<JudgedCell>& cells, double level) {
  std::size_t count = 0;
  for (const JudgedCell& cell : cells) count += cell.fresh.size();
  for (const JudgedCell& cell : cells) {
    for (const FreshNees& nees : cell.fresh) {
      const double confidence = 1.0 - level / static_cast<double>(count);
      const Interval band = chi_square_mean_band(nees.dof, nees.n, confidence);
      const FreshNees* before = find_fresh(cell.baseline_fresh, nees.name);
      const bool was_in =
          before != nullptr && chi_square_mean_band(before->dof, before->n, confidence).contains(before->mean);
      const bool is_in = band.contains(nees.mean);
      const std::string then = before != nullptr ? fmt::format(", baseline {:.3g}", before->mean) : "";
      gates.push_back(gate_of(
          cell, GateKind::kConsistency, nees.name,
          is_in    ? GateVerdict::kGreen
          : was_in ? GateVerdict::kRed
                   : GateVerdict::kNotCompared,
          fmt::format("mean NEES of {} over {} fresh seeds {:.3g}{}; a consistent estimator's lies in [{:.3g}, {:.3g}]",
                      metric_info(nees.name).label, nees.n, nees.mean, then, band.lo, band.hi)));
    }
  }
}

}  // namespace

std::vector<Gate> judge_night(const std::vector<JudgedCell>& cells, const GateRules& rules) {
  const double level = 0.5 * rules.alpha;
  std::vector<Gate> gates;
  std::vector<std::size_t> compared;  // positions in `cells`, in the order of the comparison
  std::vector<CellOutcomes> a;
  std::vector<CellOutcomes> b;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const JudgedCell& cell = cells[i];
    if (!cell.baseline || cell.baseline->trials.empty()) {
      gates.push_back(gate_of(cell, GateKind::kIdentity, "baseline", GateVerdict::kNotCompared,
                              "no baseline over the same scenario and seeds"));
    } else if (same_outcomes(*cell.baseline, cell.tonight)) {
      gates.push_back(
          gate_of(cell, GateKind::kIdentity, "identity", GateVerdict::kUnchanged,
                  fmt::format("all figures of {} trials are the baseline's, to the bit", cell.tonight.trials.size())));
    } else {
      compared.push_back(i);
      a.push_back(numbered(*cell.baseline, i));
      b.push_back(numbered(cell.tonight, i));
    }
  }
  const Comparison comparison = compare(a, b, rules.metrics, level);
  for (std::size_t k = 0; k < compared.size(); ++k) {
    const JudgedCell& cell = cells[compared[k]];
    gates.push_back(failures_gate(cell, a[k], comparison.cells[k], level));
    for (const MetricComparison& m : comparison.cells[k].metrics) {
      gates.push_back(metric_gate(cell, a[k], m, level, rules.practical_minimum));
    }
  }
  add_consistency_gates(gates, cells, level);
  return gates;
}

bool is_red(const std::vector<Gate>& gates) {
  return std::ranges::any_of(gates, [](const Gate& gate) { return gate.verdict == GateVerdict::kRed; });
}

}  // namespace plumbline::eval
