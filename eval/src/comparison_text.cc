#include <iterator>

#include <fmt/format.h>

#include "eval/comparison.h"
#include "eval/metrics.h"

namespace plumbline::eval {
namespace {

using nlohmann::ordered_json;

ordered_json to_json(const MetricComparison& m) {
  ordered_json json = {{"pairs", m.pairs}, {"rmse_a", m.rmse_a}, {"rmse_b", m.rmse_b}};
  if (!m.not_compared.empty()) {
    json["not_compared"] = m.not_compared;
    return json;
  }
  json["ratio"] = m.ratio;
  json["median_ratio"] = m.median_ratio;
  if (m.ratio_ci95) json["ratio_ci95"] = {m.ratio_ci95->lo, m.ratio_ci95->hi};
  json["p"] = m.p;
  json["p_holm"] = m.p_holm;
  if (m.detectable_ratio) json["detectable_ratio"] = *m.detectable_ratio;
  return json;
}

std::string row(const MetricComparison& m, double alpha) {
  const MetricInfo info = metric_info(m.name);
  std::string line = fmt::format("  {:<24}{:>6}{:>11.4g}{:>11.4g}", info.label, m.pairs, m.rmse_a * info.table_unit,
                                 m.rmse_b * info.table_unit);
  if (!m.not_compared.empty()) return line + "  " + m.not_compared + "\n";
  line += fmt::format("{:>8.3f} {:<16}{:>9.2g}{:>9}", m.ratio,
                      m.ratio_ci95 ? fmt::format("[{:.3f}, {:.3f}]", m.ratio_ci95->lo, m.ratio_ci95->hi) : "", m.p_holm,
                      m.detectable_ratio ? fmt::format("{:.3f}", *m.detectable_ratio) : "");
  if (m.p_holm <= alpha) line += m.ratio > 1.0 ? "  worse" : "  better";
  return line + "\n";
}

}  // namespace

ordered_json to_json(const Comparison& comparison) {
  ordered_json cells = ordered_json::array();
  for (const CellComparison& cell : comparison.cells) {
    ordered_json metrics = ordered_json::object();
    for (const MetricComparison& m : cell.metrics) metrics[m.name] = to_json(m);
    cells.push_back({{"axes", cell.axes},
                     {"n", cell.n},
                     {"n_ok_a", cell.n_ok_a},
                     {"n_ok_b", cell.n_ok_b},
                     {"only_a_failed", cell.only_a_failed},
                     {"only_b_failed", cell.only_b_failed},
                     {"p_failures", cell.p_failures},
                     {"p_failures_holm", cell.p_failures_holm},
                     {"metrics", std::move(metrics)}});
  }
  return {{"worse", comparison.worse},
          {"alpha", comparison.alpha},
          {"tests", comparison.tests},
          {"cells", std::move(cells)}};
}

std::string comparison_table(const Comparison& comparison) {
  std::string out;
  for (const CellComparison& cell : comparison.cells) {
    fmt::format_to(std::back_inserter(out), "{}{}   A {}/{} ok, B {}/{} ok", out.empty() ? "" : "\n",
                   cell.axes.empty() ? "all trials" : cell.axes.dump(), cell.n_ok_a, cell.n, cell.n_ok_b, cell.n);
    if (cell.only_a_failed + cell.only_b_failed > 0) {
      fmt::format_to(std::back_inserter(out), "; failed in A only {}, in B only {} (p = {:.2g})", cell.only_a_failed,
                     cell.only_b_failed, cell.p_failures_holm);
    }
    out += '\n';
    if (cell.metrics.empty()) {
      out += "  no trial is ok in both\n";
      continue;
    }
    fmt::format_to(std::back_inserter(out), "  {:<24}{:>6}{:>11}{:>11}{:>8} {:<16}{:>9}{:>9}\n", "metric", "pairs",
                   "rmse A", "rmse B", "B/A", "95 % interval", "p", "80 %");
    for (const MetricComparison& m : cell.metrics) out += row(m, comparison.alpha);
  }
  fmt::format_to(std::back_inserter(out),
                 "\np: signed rank or McNemar, adjusted over {} tests (Holm); 80 %: the ratio found in 4 of 5 such "
                 "comparisons\nB is {} (alpha {})\n",
                 comparison.tests, comparison.worse ? "worse" : "not significantly worse", comparison.alpha);
  return out;
}

}  // namespace plumbline::eval
