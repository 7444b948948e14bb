#include "eval/summary.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <stdexcept>
#include <utility>

#include <boost/math/distributions/chi_squared.hpp>
#include <fmt/format.h>

#include "eval/bootstrap.h"
#include "eval/cramer_rao.h"
#include "eval/metrics.h"

namespace plumbline::eval {
namespace {

constexpr double kThreeSigma = 0.9973002039367398;  // of a Gaussian within three standard deviations
constexpr int kLogarithmTrials = 20;                // with fewer rms_interval covers too seldom
constexpr int kAllAgree = 10'000;                   // trials, at which resampling would only take long

void require_same_metrics(const Row& a, const Row& b) {
  const auto differ = [](const Metric& x, const Metric& y) { return x.name != y.name || x.nees_dof != y.nees_dof; };
  bool same = a.metrics.size() == b.metrics.size();
  for (std::size_t i = 0; same && i < a.metrics.size(); ++i) same = !differ(a.metrics[i], b.metrics[i]);
  if (!same) throw std::invalid_argument(fmt::format("runs {} and {} hold different metrics", a.run_id, b.run_id));
}

NeesSummary summarise_nees(const std::vector<double>& nees, int dof) {
  const auto n = static_cast<int>(nees.size());
  const double limit = boost::math::quantile(boost::math::chi_squared(dof), kThreeSigma);
  const auto within = static_cast<int>(std::count_if(nees.begin(), nees.end(), [&](double x) { return x <= limit; }));
  return {.dof = dof,
          .mean = mean(nees),
          .band95 = chi_square_mean_band(dof, n, kConfidence),
          .within_3_sigma = within / static_cast<double>(n),
          .within_3_sigma_ci95 = binomial_interval(within, n, kConfidence)};
}

std::optional<Interval> root_mean_square_interval(const std::vector<double>& values, bool is_signed) {
  const auto n = static_cast<int>(values.size());
  if (n < 2) return std::nullopt;
  if (is_signed) return rmse_interval(root_mean_square(values), n, kConfidence);
  if (n < kLogarithmTrials) return std::nullopt;
  if (n < kBootstrapTrials || n >= kAllAgree) return rms_interval(values, kConfidence);
  return bca_interval(values, root_mean_square, kConfidence);
}

ConvergenceSummary summarise_convergence(const std::vector<const Row*>& rows, std::size_t metric) {
  ConvergenceSummary summary;
  std::vector<double> times;
  for (const Row* row : rows) {
    const Metric& m = row->metrics[metric];
    summary.n_converged += m.censored ? 0 : 1;
    times.push_back(m.censored ? std::numeric_limits<double>::infinity() : m.value);
  }
  const auto n = static_cast<int>(times.size());
  summary.share_ci95 = binomial_interval(summary.n_converged, n, kConfidence);
  if (summary.n_converged <= n / 2) return summary;  // one of those in the middle is infinite
  std::sort(times.begin(), times.end());
  const std::size_t size = times.size();
  summary.median_s = 0.5 * (times[(size - 1) / 2] + times[size / 2]);
  return summary;
}

MetricSummary summarise_values(const std::string& name, const std::vector<double>& values) {
  const bool is_signed = metric_info(name).is_signed;
  MetricSummary summary{.name = name,
                        .mean = mean(values),
                        .rmse = root_mean_square(values),
                        .median = median(values),
                        .std = sample_std(values),
                        .q05 = quantile(values, 0.05),
                        .q95 = quantile(values, 0.95),
                        .mean_ci95 = {},
                        .rmse_ci95 = root_mean_square_interval(values, is_signed),
                        .nees = {},
                        .bound = {}};
  if (is_signed) summary.mean_ci95 = mean_interval(values, kConfidence);
  return summary;
}

// Nothing where a trial has no bound of it.
std::optional<BoundSummary> summarise_bound(const std::vector<const Row*>& rows, std::size_t i,
                                            const MetricSummary& metric, bool may_claim) {
  std::vector<double> bounds;
  for (const Row* row : rows) {
    const std::optional<double>& crlb = row->metrics[i].crlb;
    if (!crlb) return std::nullopt;
    bounds.push_back(*crlb);
  }
  BoundSummary summary{.crlb = root_mean_square(bounds), .efficiency = {}, .efficiency_ci95 = {}};
  if (!may_claim) return summary;
  summary.efficiency = metric.rmse / summary.crlb;
  if (metric.rmse_ci95) {
    summary.efficiency_ci95 = Interval{metric.rmse_ci95->lo / summary.crlb, metric.rmse_ci95->hi / summary.crlb};
  }
  return summary;
}

// The bound neglects the gyroscope's noise within the gaps between states and observations.
bool gaps_are_short(const std::vector<const Row*>& rows) {
  return std::all_of(rows.begin(), rows.end(), [](const Row* row) {
    return std::none_of(row->metrics.begin(), row->metrics.end(),
                        [](const Metric& m) { return m.name == kKappa2 && m.value > kLargestKappa2; });
  });
}

// Nothing where an estimator gives no residuals.
std::optional<NisSummary> summarise_nis(const std::vector<const Row*>& rows) {
  double squares = 0.0;
  NisSummary summary;
  for (const Row* row : rows) {
    const SolverFigures& solver = row->solver;
    if (!(solver.cost_per_dof > 0.0)) return std::nullopt;
    squares += 2.0 * solver.final_cost;
    summary.dof += std::round(2.0 * solver.final_cost / solver.cost_per_dof);
  }
  summary.mean = squares / summary.dof;
  const boost::math::chi_squared distribution(summary.dof);
  const double tail = 0.5 * (1.0 - kConfidence);
  summary.band95 = {boost::math::quantile(distribution, tail) / summary.dof,
                    boost::math::quantile(boost::math::complement(distribution, tail)) / summary.dof};
  return summary;
}

// Where some of the rows have the errors of lines and others none, they are taken from all.
void keep_line_errors_of_all(std::vector<Row>& rows) {
  const auto is_line_error = [](const Metric& m) { return m.name == kLineAngle || m.name == kLineDistance; };
  const auto has = [&](const Row& row) { return std::any_of(row.metrics.begin(), row.metrics.end(), is_line_error); };
  if (std::all_of(rows.begin(), rows.end(), has)) return;
  for (Row& row : rows) std::erase_if(row.metrics, is_line_error);
}

}  // namespace

CellSummary summarise(const std::vector<Row>& rows, nlohmann::ordered_json axes, const std::string& no_claim) {
  CellSummary cell{.axes = std::move(axes),
                   .n = static_cast<int>(rows.size()),
                   .n_ok = 0,
                   .metrics = {},
                   .td_convergence = {},
                   .nis = {},
                   .note = {}};
  std::vector<Row> rows_ok;
  std::copy_if(rows.begin(), rows.end(), std::back_inserter(rows_ok), [](const Row& row) { return row.ok; });
  cell.n_ok = static_cast<int>(rows_ok.size());
  if (rows_ok.empty()) return cell;
  keep_line_errors_of_all(rows_ok);
  std::vector<const Row*> ok;
  ok.reserve(rows_ok.size());
  for (const Row& row : rows_ok) ok.push_back(&row);
  for (const Row* row : ok) require_same_metrics(*ok.front(), *row);

  const bool all_ok = cell.n_ok == cell.n;
  const bool may_claim = all_ok && no_claim.empty();
  const bool short_gaps = gaps_are_short(ok);
  bool has_nees = false;
  bool has_bound = false;
  for (std::size_t i = 0; i < ok.front()->metrics.size(); ++i) {
    const Metric& first = ok.front()->metrics[i];
    if (first.name == kTdConvergence) {
      cell.td_convergence = summarise_convergence(ok, i);
      continue;
    }
    std::vector<double> values;
    std::vector<double> nees;
    for (const Row* row : ok) {
      const Metric& metric = row->metrics[i];
      values.push_back(metric.value);
      if (metric.nees) nees.push_back(*metric.nees);
    }
    cell.metrics.push_back(summarise_values(first.name, values));
    MetricSummary& metric = cell.metrics.back();
    metric.bound = summarise_bound(ok, i, metric, may_claim && short_gaps);
    if (may_claim && !nees.empty()) metric.nees = summarise_nees(nees, first.nees_dof);
    has_nees = has_nees || !nees.empty();
    has_bound = has_bound || metric.bound.has_value();
  }
  if (may_claim && has_nees) cell.nis = summarise_nis(ok);
  if (!all_ok && (has_nees || has_bound)) {
    cell.note = fmt::format("no NEES or efficiency is claimed: {} of {} trials failed", cell.n - cell.n_ok, cell.n);
  } else if (!no_claim.empty()) {
    cell.note = fmt::format("no NEES or efficiency is claimed: {}", no_claim);
  } else if (has_bound && !short_gaps) {
    cell.note =
        fmt::format("no efficiency is claimed: the bound neglects too much, kappa2 is above {}", kLargestKappa2);
  }
  return cell;
}

nlohmann::ordered_json to_json(const CellSummary& cell) {
  using nlohmann::ordered_json;
  const auto pair = [](const Interval& interval) { return ordered_json::array({interval.lo, interval.hi}); };
  ordered_json metrics = ordered_json::object();
  for (const MetricSummary& m : cell.metrics) {
    ordered_json json = {{"mean", m.mean}, {"rmse", m.rmse}, {"median", m.median}};
    if (m.std) json["std"] = *m.std;
    json["q05"] = m.q05;
    json["q95"] = m.q95;
    if (m.mean_ci95) json["mean_ci95"] = pair(*m.mean_ci95);
    if (m.rmse_ci95) json["rmse_ci95"] = pair(*m.rmse_ci95);
    if (m.bound) {
      json["crlb"] = m.bound->crlb;
      if (m.bound->efficiency) json["efficiency"] = *m.bound->efficiency;
      if (m.bound->efficiency_ci95) json["efficiency_ci95"] = pair(*m.bound->efficiency_ci95);
    }
    if (m.nees) {
      json["nees_dof"] = m.nees->dof;
      json["nees_mean"] = m.nees->mean;
      json["nees_band95"] = pair(m.nees->band95);
      json["within_3_sigma"] = m.nees->within_3_sigma;
      json["within_3_sigma_ci95"] = pair(m.nees->within_3_sigma_ci95);
    }
    metrics[m.name] = std::move(json);
  }
  ordered_json json = {{"axes", cell.axes}, {"n", cell.n}, {"n_ok", cell.n_ok}, {"metrics", std::move(metrics)}};
  if (cell.td_convergence) {
    json["td_convergence"] = {{"n_converged", cell.td_convergence->n_converged},
                              {"share_ci95", pair(cell.td_convergence->share_ci95)}};
    if (cell.td_convergence->median_s) json["td_convergence"]["median_s"] = *cell.td_convergence->median_s;
  }
  if (cell.nis) json["nis"] = {{"dof", cell.nis->dof}, {"mean", cell.nis->mean}, {"band95", pair(cell.nis->band95)}};
  if (!cell.note.empty()) json["note"] = cell.note;
  return json;
}

}  // namespace plumbline::eval
