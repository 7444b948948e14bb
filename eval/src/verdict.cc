#include "eval/verdict.h"

#include <algorithm>

#include <fmt/format.h>

#include "eval/metrics.h"

namespace plumbline::eval {
namespace {

constexpr double kFalseAttention = 0.01;

struct ConsistencyFigure {
  std::string what;
  double mean = 0.0;
  double dof = 0.0;
  int n = 0;
  bool in_band95 = true;
};

std::string plain_label(std::string_view label) { return std::string(label.substr(0, label.find(" ["))); }

std::vector<ConsistencyFigure> consistency_figures(const std::vector<CellSummary>& cells) {
  std::vector<ConsistencyFigure> figures;
  for (std::size_t c = 0; c < cells.size(); ++c) {
    const std::string where = cells.size() > 1 ? fmt::format(" in cell {}", c) : "";
    for (const MetricSummary& m : cells[c].metrics) {
      if (!m.nees) continue;
      figures.push_back({fmt::format("{}{}", plain_label(metric_info(m.name).label), where), m.nees->mean,
                         static_cast<double>(m.nees->dof), cells[c].n_ok, m.nees->band95.contains(m.nees->mean)});
    }
  }
  return figures;
}

// Lowest and highest over the cells, as "0.96 to 1.11"; empty without any.
std::string range_text(const std::vector<double>& values, const char* unit) {
  if (values.empty()) return "";
  const auto [lo, hi] = std::minmax_element(values.begin(), values.end());
  const std::string a = fmt::format("{:.3g}", *lo);
  const std::string b = fmt::format("{:.3g}", *hi);
  return (a == b ? a : fmt::format("{} to {}", a, b)) + unit;
}

void add_accuracy(Verdict& verdict, const std::vector<CellSummary>& cells, const char* name) {
  const MetricInfo info = metric_info(name);
  std::vector<double> rmse;
  std::vector<double> efficiency;
  for (const CellSummary& cell : cells) {
    for (const MetricSummary& m : cell.metrics) {
      if (m.name != name) continue;
      rmse.push_back(m.rmse * info.table_unit);
      if (m.bound && m.bound->efficiency) efficiency.push_back(*m.bound->efficiency);
    }
  }
  if (rmse.empty()) return;
  const std::string_view label = info.label;
  const std::size_t bracket = label.find(" [");
  const std::string unit = bracket == std::string_view::npos
                               ? ""
                               : fmt::format(" {}", label.substr(bracket + 2, label.size() - bracket - 3));
  std::string text = fmt::format("{}: RMSE {}", plain_label(label), range_text(rmse, unit.c_str()));
  if (!efficiency.empty()) text += fmt::format(", {} times the Cramer-Rao bound", range_text(efficiency, ""));
  verdict.findings.push_back(text + (cells.size() > 1 ? ", over the cells." : "."));
}

// Whether a figure is out of its widened band.
bool add_consistency(Verdict& verdict, const std::vector<CellSummary>& cells) {
  const std::vector<ConsistencyFigure> figures = consistency_figures(cells);
  if (figures.empty()) {
    verdict.findings.emplace_back("Consistency is not claimed: no NEES (see the notes of the cells).");
    return false;
  }
  const double confidence = 1.0 - kFalseAttention / static_cast<double>(figures.size());
  std::string out;
  std::size_t outside = 0;
  std::size_t outside95 = 0;
  for (const ConsistencyFigure& f : figures) {
    outside95 += f.in_band95 ? 0 : 1;
    const Interval band = chi_square_mean_band(static_cast<int>(f.dof), f.n, confidence);
    if (band.contains(f.mean)) continue;
    if (++outside > 5) continue;
    out += fmt::format("{}{} ({:.3g}, {:.3g} expected)", outside > 1 ? ", " : "", f.what, f.mean, f.dof);
  }
  if (outside > 5) out += fmt::format(" and {} more", outside - 5);
  verdict.findings.push_back(
      outside > 0
          ? fmt::format("Inconsistent: mean NEES of {}.", out)
          : fmt::format("Consistent: of {} mean NEES, {} lie outside their 95 % band; about {:.1f} would by chance.",
                        figures.size(), outside95, 0.05 * static_cast<double>(figures.size())));
  return outside > 0;
}

}  // namespace

Verdict judge(const std::vector<CellSummary>& cells, double max_failed_share) {
  Verdict verdict;
  int n = 0;
  int n_ok = 0;
  for (const CellSummary& cell : cells) {
    n += cell.n;
    n_ok += cell.n_ok;
  }
  verdict.findings.push_back(fmt::format("{} of {} trials gave an answer.", n_ok, n));
  for (const char* name : {"td_error_s", "ate_position_m"}) add_accuracy(verdict, cells, name);
  const bool inconsistent = add_consistency(verdict, cells);
  const int failed = n - n_ok;
  if (failed > max_failed_share * n || n_ok == 0) {
    verdict.level = VerdictLevel::kFailed;
    verdict.headline = fmt::format("{} of {} trials failed, more than allowed", failed, n);
  } else if (failed > 0 || inconsistent) {
    verdict.level = VerdictLevel::kAttention;
    verdict.headline =
        failed > 0 && inconsistent
            ? fmt::format("{} of {} trials failed, and the estimator's covariance does not fit its errors", failed, n)
        : failed > 0 ? fmt::format("{} of {} trials failed, as many as are allowed", failed, n)
                     : "The estimator's covariance does not fit its errors";
  } else {
    verdict.headline = consistency_figures(cells).empty()
                           ? "All trials gave an answer"
                           : "All trials gave an answer, with errors as large as the estimator says";
  }
  return verdict;
}

}  // namespace plumbline::eval
