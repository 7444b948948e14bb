#include "eval/comparison.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include <fmt/format.h>

#include "core/error.h"
#include "eval/metrics.h"
#include "eval/multiple_tests.h"
#include "eval/signed_rank.h"

namespace plumbline::eval {
namespace {

constexpr double kPower = 0.8;

using Key = std::pair<std::uint64_t, int>;  // seed, trial

std::map<Key, const TrialOutcome*> by_key(const CellOutcomes& cell, const char* which) {
  std::map<Key, const TrialOutcome*> result;
  for (const TrialOutcome& t : cell.trials) {
    if (!result.emplace(Key{t.seed, t.trial}, &t).second) {
      throw core::DataError(
          fmt::format("{}: trial {} of seed {} is there twice in cell {}", which, t.trial, t.seed, cell.axes.dump()));
    }
  }
  return result;
}

// Keys in any order are the same axes.
std::string canonical(const nlohmann::ordered_json& axes) { return nlohmann::json(axes).dump(); }

const CellOutcomes& partner(const CellOutcomes& cell, const std::vector<CellOutcomes>& others, const char* which) {
  for (const CellOutcomes& other : others) {
    if (canonical(other.axes) == canonical(cell.axes)) return other;
  }
  throw core::DataError(fmt::format("{} has no cell {}", which, cell.axes.dump()));
}

struct PairedTrials {
  std::vector<std::pair<const TrialOutcome*, const TrialOutcome*>> all;
  std::vector<std::pair<const TrialOutcome*, const TrialOutcome*>> ok;  // in both
};

PairedTrials pair_trials(const CellOutcomes& a, const CellOutcomes& b) {
  const auto in_a = by_key(a, "A");
  const auto in_b = by_key(b, "B");
  PairedTrials pairs;
  for (const auto& [key, trial] : in_a) {
    const auto other = in_b.find(key);
    if (other == in_b.end()) {
      throw core::DataError(
          fmt::format("B has no trial {} of seed {} in cell {}", key.second, key.first, a.axes.dump()));
    }
    pairs.all.emplace_back(trial, other->second);
    if (trial->ok && other->second->ok) pairs.ok.emplace_back(trial, other->second);
  }
  for (const auto& [key, trial] : in_b) {
    if (!in_a.contains(key)) {
      throw core::DataError(
          fmt::format("A has no trial {} of seed {} in cell {}", key.second, key.first, a.axes.dump()));
    }
  }
  return pairs;
}

// names.size() where it is not among them.
std::size_t position(const std::vector<std::string>& names, const std::string& name) {
  return static_cast<std::size_t>(std::find(names.begin(), names.end(), name) - names.begin());
}

std::vector<std::string> common_metrics(const CellOutcomes& a, const CellOutcomes& b,
                                        const std::vector<std::string>& wanted) {
  std::vector<std::string> names;
  for (const std::string& name : wanted.empty() ? a.metrics : wanted) {
    const bool both = position(a.metrics, name) < a.metrics.size() && position(b.metrics, name) < b.metrics.size();
    if (!wanted.empty() && !both) throw core::DataError(fmt::format("not both hold a metric '{}'", name));
    if (both && (!wanted.empty() || metric_info(name).in_table)) names.push_back(name);
  }
  return names;
}

// All but what depends on the other tests.
MetricComparison compare_metric(const std::string& name, const std::vector<double>& a, const std::vector<double>& b,
                                std::vector<double>& log_ratios) {
  MetricComparison m;
  m.name = name;
  m.pairs = static_cast<int>(a.size());
  if (a.empty()) {
    m.not_compared = "no trial is ok in both";
    return m;
  }
  m.rmse_a = root_mean_square(a);
  m.rmse_b = root_mean_square(b);
  for (std::size_t i = 0; i < a.size(); ++i) {
    const double x = std::abs(a[i]);
    const double y = std::abs(b[i]);
    if (x != y && (x == 0.0 || y == 0.0)) {
      log_ratios.clear();
      m.not_compared = "an error is exactly 0 in one of the two";
      return m;
    }
    log_ratios.push_back(x == y ? 0.0 : std::log(y) - std::log(x));
  }
  m.ratio = std::exp(hodges_lehmann(log_ratios));
  m.median_ratio = std::exp(median(log_ratios));
  if (const auto interval = hodges_lehmann_interval(log_ratios, kConfidence)) {
    m.ratio_ci95 = Interval{std::exp(interval->lo), std::exp(interval->hi)};
  }
  m.p = signed_rank_p_value(log_ratios);
  return m;
}

std::vector<double> values_of(const PairedTrials& pairs, bool of_a, std::size_t position) {
  std::vector<double> values;
  values.reserve(pairs.ok.size());
  for (const auto& [a, b] : pairs.ok) values.push_back((of_a ? a : b)->values[position]);
  return values;
}

struct Compared {
  CellComparison cell;
  std::vector<std::vector<double>> log_ratios;  // one list a metric
};

Compared compare_cell(const CellOutcomes& a, const CellOutcomes& b, const std::vector<std::string>& wanted) {
  const PairedTrials pairs = pair_trials(a, b);
  Compared result;
  CellComparison& cell = result.cell;
  cell.axes = a.axes;
  cell.n = static_cast<int>(pairs.all.size());
  for (const auto& [x, y] : pairs.all) {
    cell.n_ok_a += x->ok ? 1 : 0;
    cell.n_ok_b += y->ok ? 1 : 0;
    cell.only_a_failed += !x->ok && y->ok ? 1 : 0;
    cell.only_b_failed += x->ok && !y->ok ? 1 : 0;
  }
  cell.p_failures = mcnemar_p_value(cell.only_a_failed, cell.only_b_failed);
  if (cell.n_ok_a == 0 || cell.n_ok_b == 0) return result;
  for (const std::string& name : common_metrics(a, b, wanted)) {
    std::vector<double> log_ratios;
    cell.metrics.push_back(compare_metric(name, values_of(pairs, true, position(a.metrics, name)),
                                          values_of(pairs, false, position(b.metrics, name)), log_ratios));
    result.log_ratios.push_back(std::move(log_ratios));
  }
  return result;
}

// Adjusts all p values together and states the power at the level of Holm's first step.
void adjust(Comparison& comparison, const std::vector<std::vector<std::vector<double>>>& log_ratios) {
  std::vector<double> p;
  for (const CellComparison& cell : comparison.cells) {
    p.push_back(cell.p_failures);
    for (const MetricComparison& m : cell.metrics) {
      if (m.not_compared.empty()) p.push_back(m.p);
    }
  }
  comparison.tests = static_cast<int>(p.size());
  const std::vector<double> adjusted = holm(p);
  auto next = adjusted.begin();
  for (std::size_t c = 0; c < comparison.cells.size(); ++c) {
    CellComparison& cell = comparison.cells[c];
    cell.p_failures_holm = *next++;
    const bool fails_more = cell.only_b_failed > cell.only_a_failed;
    comparison.worse = comparison.worse || (fails_more && cell.p_failures_holm <= comparison.alpha);
    for (std::size_t i = 0; i < cell.metrics.size(); ++i) {
      MetricComparison& m = cell.metrics[i];
      if (!m.not_compared.empty()) continue;
      m.p_holm = *next++;
      comparison.worse = comparison.worse || (m.ratio > 1.0 && m.p_holm <= comparison.alpha);
      const auto sigma = sample_std(log_ratios[c][i]);
      if (!sigma) continue;
      const auto shift = smallest_detectable_shift(*sigma, m.pairs, comparison.alpha / comparison.tests, kPower);
      if (shift) m.detectable_ratio = std::exp(*shift);
    }
  }
}

}  // namespace

void CellOutcomes::add(const Row& row) {
  TrialOutcome outcome{.trial = row.trial, .seed = row.seed, .ok = row.ok, .values = {}};
  if (row.ok) {
    std::vector<std::string> names;
    for (const Metric& metric : row.metrics) {
      names.push_back(metric.name);
      outcome.values.push_back(metric.value);
    }
    if (metrics.empty()) metrics = names;
    if (metrics != names) throw core::DataError(fmt::format("run {}: other metrics than its cell's", row.run_id));
  }
  trials.push_back(std::move(outcome));
}

Comparison compare(const std::vector<CellOutcomes>& a, const std::vector<CellOutcomes>& b,
                   const std::vector<std::string>& metrics, double alpha) {
  for (const CellOutcomes& cell : b) partner(cell, a, "A");
  Comparison comparison;
  comparison.alpha = alpha;
  std::vector<std::vector<std::vector<double>>> log_ratios;
  for (const CellOutcomes& cell : a) {
    Compared compared = compare_cell(cell, partner(cell, b, "B"), metrics);
    comparison.cells.push_back(std::move(compared.cell));
    log_ratios.push_back(std::move(compared.log_ratios));
  }
  adjust(comparison, log_ratios);
  return comparison;
}

}  // namespace plumbline::eval
