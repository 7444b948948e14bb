#include "eval/summary.h"

#include <stdexcept>
#include <utility>

#include <fmt/format.h>

#include "eval/metrics.h"

namespace plumbline::eval {
namespace {

constexpr double kConfidence = 0.95;

void require_same_metrics(const Row& a, const Row& b) {
  const auto differ = [](const Metric& x, const Metric& y) { return x.name != y.name || x.nees_dof != y.nees_dof; };
  bool same = a.metrics.size() == b.metrics.size();
  for (std::size_t i = 0; same && i < a.metrics.size(); ++i) same = !differ(a.metrics[i], b.metrics[i]);
  if (!same) throw std::invalid_argument(fmt::format("runs {} and {} hold different metrics", a.run_id, b.run_id));
}

NeesSummary summarise_nees(const std::vector<double>& nees, int dof) {
  return {dof, mean(nees), chi_square_mean_band(dof, static_cast<int>(nees.size()), kConfidence)};
}

MetricSummary summarise_values(const std::string& name, const std::vector<double>& values) {
  const auto n = static_cast<int>(values.size());
  const double rmse = root_mean_square(values);
  MetricSummary summary{.name = name,
                        .mean = mean(values),
                        .rmse = rmse,
                        .median = median(values),
                        .std = sample_std(values),
                        .rmse_ci95 = {},
                        .nees = {}};
  if (n >= 2) {
    summary.rmse_ci95 =
        metric_info(name).is_signed ? rmse_interval(rmse, n, kConfidence) : rms_interval(values, kConfidence);
  }
  return summary;
}

}  // namespace

CellSummary summarise(const std::vector<Row>& rows, nlohmann::ordered_json axes) {
  CellSummary cell{.axes = std::move(axes), .n = static_cast<int>(rows.size()), .n_ok = 0, .metrics = {}, .note = {}};
  std::vector<const Row*> ok;
  for (const Row& row : rows) {
    if (row.ok) ok.push_back(&row);
  }
  cell.n_ok = static_cast<int>(ok.size());
  if (ok.empty()) return cell;
  for (const Row* row : ok) require_same_metrics(*ok.front(), *row);

  bool withheld = false;
  for (std::size_t i = 0; i < ok.front()->metrics.size(); ++i) {
    const Metric& first = ok.front()->metrics[i];
    std::vector<double> values;
    std::vector<double> nees;
    for (const Row* row : ok) {
      const Metric& metric = row->metrics[i];
      values.push_back(metric.value);
      if (metric.nees) nees.push_back(*metric.nees);
    }
    cell.metrics.push_back(summarise_values(first.name, values));
    if (nees.empty()) continue;
    if (cell.n_ok == cell.n) {
      cell.metrics.back().nees = summarise_nees(nees, first.nees_dof);
    } else {
      withheld = true;
    }
  }
  if (withheld) cell.note = fmt::format("no NEES is claimed: {} of {} trials failed", cell.n - cell.n_ok, cell.n);
  return cell;
}

nlohmann::ordered_json to_json(const CellSummary& cell) {
  using nlohmann::ordered_json;
  const auto pair = [](const Interval& interval) { return ordered_json::array({interval.lo, interval.hi}); };
  ordered_json metrics = ordered_json::object();
  for (const MetricSummary& m : cell.metrics) {
    ordered_json json = {{"mean", m.mean}, {"rmse", m.rmse}, {"median", m.median}};
    if (m.std) json["std"] = *m.std;
    if (m.rmse_ci95) json["rmse_ci95"] = pair(*m.rmse_ci95);
    if (m.nees) {
      json["nees_dof"] = m.nees->dof;
      json["nees_mean"] = m.nees->mean;
      json["nees_band95"] = pair(m.nees->band95);
    }
    metrics[m.name] = std::move(json);
  }
  ordered_json json = {{"axes", cell.axes}, {"n", cell.n}, {"n_ok", cell.n_ok}, {"metrics", std::move(metrics)}};
  if (!cell.note.empty()) json["note"] = cell.note;
  return json;
}

}  // namespace plumbline::eval
