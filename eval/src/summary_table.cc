#include "eval/summary_table.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <iterator>
#include <string_view>

#include <fmt/format.h>

#include "eval/metrics.h"

namespace plumbline::eval {
namespace {

constexpr int kWidth = 100;
constexpr const char* kRow = "  {:<24}{:>10}{:>10} {:<20}{:>10} {}\n";

// Four significant digits of the reference, the row's RMSE, set the decimals of the whole row.
std::string figure(double value, double reference) {
  const double magnitude = reference == 0.0 ? 0.0 : std::floor(std::log10(std::abs(reference)));
  if (magnitude < -3.0 || magnitude > 6.0) return fmt::format("{:.2e}", value);
  const std::string text = fmt::format("{:.{}f}", value, std::clamp(3 - static_cast<int>(magnitude), 0, 6));
  return std::strtod(text.c_str(), nullptr) == 0.0 && text.starts_with('-') ? text.substr(1) : text;  // no -0.00
}

std::string nees_text(const NeesSummary& nees) {
  const std::string value = nees.mean < 1e3   ? fmt::format("{:.2f}", nees.mean)
                            : nees.mean < 1e6 ? fmt::format("{:.0f}", nees.mean)
                                              : ">1e6";
  return fmt::format("{:>6}{}({:.2f}, {:.2f})", value, nees.band95.contains(nees.mean) ? "  " : "! ", nees.band95.lo,
                     nees.band95.hi);
}

std::string title(const CellSummary& cell) {
  std::string text;
  for (const auto& axis : cell.axes.items()) {
    const auto& value = axis.value();
    text += fmt::format("{}{} = {}", text.empty() ? "" : ", ", axis.key(),
                        value.is_string() ? value.get<std::string>() : value.dump());
  }
  return text.empty() ? "all trials" : text;
}

// The axes to the left, n_ok/n to the right, over more than one line where they do not fit.
void append_title(std::string& out, const CellSummary& cell) {
  std::string rest = title(cell);
  const std::string count = fmt::format("{}/{} ok", cell.n_ok, cell.n);
  const auto room = static_cast<std::size_t>(kWidth) - count.size() - 2;
  while (rest.size() > room) {
    const std::size_t comma = rest.rfind(", ", room);
    const std::size_t cut = comma == std::string::npos ? rest.find(", ") : comma;
    if (cut == std::string::npos) break;
    fmt::format_to(std::back_inserter(out), "{},\n", rest.substr(0, cut));
    rest.erase(0, cut + 2);
  }
  fmt::format_to(std::back_inserter(out), "{:<{}}  {}\n", rest, room, count);
}

// The last columns of figures hold the bound and RMSE / bound where there is one, else the median.
void append_metric(std::string& out, const MetricSummary& m, bool bound_column) {
  const MetricInfo info = metric_info(m.name);
  const std::string nees = m.nees ? nees_text(*m.nees) : "";
  const auto last_columns = [&](const std::string& ratio) {
    return bound_column ? fmt::format("{:>6} {}", ratio, nees) : nees;
  };
  if (!info.in_table) {
    if (m.nees) {
      fmt::format_to(std::back_inserter(out), fmt::runtime(kRow), info.label, "", "", "", "", last_columns(""));
    }
    return;
  }
  const double reference = m.rmse * info.table_unit;
  const auto shown = [&](double value) { return figure(value * info.table_unit, reference); };
  const std::string interval =
      m.rmse_ci95 ? fmt::format("[{}, {}]", shown(m.rmse_ci95->lo), shown(m.rmse_ci95->hi)) : "";
  fmt::format_to(std::back_inserter(out), fmt::runtime(kRow), info.label, shown(m.mean), shown(m.rmse), interval,
                 bound_column ? (m.bound ? shown(m.bound->crlb) : "") : shown(m.median),
                 last_columns(m.bound && m.bound->efficiency ? fmt::format("{:.2f}", *m.bound->efficiency) : ""));
}

void append_markdown(std::string& out, const MetricSummary& m) {
  const MetricInfo info = metric_info(m.name);
  if (!info.in_table && !m.nees) return;
  const auto shown = [&](double value) { return figure(value * info.table_unit, m.rmse * info.table_unit); };
  const auto of_table = [&](const std::string& text) { return info.in_table ? text : std::string(); };
  fmt::format_to(std::back_inserter(out), "| {} | {} | {} | {} | {} | {} | {} |\n", info.label, of_table(shown(m.mean)),
                 of_table(shown(m.rmse)),
                 m.rmse_ci95 ? of_table(fmt::format("{} to {}", shown(m.rmse_ci95->lo), shown(m.rmse_ci95->hi))) : "",
                 m.bound ? of_table(shown(m.bound->crlb)) : "",
                 m.bound && m.bound->efficiency ? of_table(fmt::format("{:.2f}", *m.bound->efficiency)) : "",
                 m.nees ? nees_text(*m.nees) : "");
}

}  // namespace

std::string summary_markdown(const std::vector<CellSummary>& cells) {
  std::string out;
  for (const CellSummary& cell : cells) {
    fmt::format_to(std::back_inserter(out), "{}**{}**, {}/{} ok\n\n", out.empty() ? "" : "\n", title(cell), cell.n_ok,
                   cell.n);
    if (cell.metrics.empty()) {
      out += "No trial succeeded.\n";
      continue;
    }
    out += "| metric | mean | RMSE | 95 % interval | bound | RMSE / bound | mean NEES (95 % band) |\n";
    out += "|---|---:|---:|---|---:|---:|---:|\n";
    for (const MetricSummary& metric : cell.metrics) append_markdown(out, metric);
    if (!cell.note.empty()) fmt::format_to(std::back_inserter(out), "\n{}\n", cell.note);
  }
  return out;
}

std::string summary_table(const std::vector<CellSummary>& cells) {
  std::string out;
  for (const CellSummary& cell : cells) {
    if (!out.empty()) out += '\n';
    append_title(out, cell);
    if (cell.metrics.empty()) {
      out += "  no trial succeeded\n";
    } else {
      const bool has_bound = std::any_of(cell.metrics.begin(), cell.metrics.end(),
                                         [](const MetricSummary& m) { return m.bound.has_value(); });
      fmt::format_to(std::back_inserter(out), fmt::runtime(kRow), "metric", "mean", "rmse", "[95 % interval]",
                     has_bound ? "bound" : "median", has_bound ? " ratio   NEES  (95 % band)" : "  NEES  (95 % band)");
      for (const MetricSummary& metric : cell.metrics) append_metric(out, metric, has_bound);
    }
    if (cell.td_convergence) {
      const ConvergenceSummary& c = *cell.td_convergence;
      fmt::format_to(std::back_inserter(out), "  td converged for good in {}/{} trials{}\n", c.n_converged, cell.n_ok,
                     c.median_s ? fmt::format(", median after {:.3g} s", *c.median_s) : "");
    }
    if (cell.nis) {
      fmt::format_to(std::back_inserter(out), "  squared residuals per degree of freedom {:.4f}{}({:.4f}, {:.4f})\n",
                     cell.nis->mean, cell.nis->band95.contains(cell.nis->mean) ? "  " : "! ", cell.nis->band95.lo,
                     cell.nis->band95.hi);
    }
    if (!cell.note.empty()) fmt::format_to(std::back_inserter(out), "  {}\n", cell.note);
  }
  // Columns that are empty at the end of a line leave blanks behind.
  std::string trimmed;
  for (std::size_t begin = 0; begin < out.size();) {
    const std::size_t end = out.find('\n', begin);
    const std::string_view line(out.data() + begin, end - begin);
    trimmed.append(line.substr(0, line.find_last_not_of(' ') + 1)).append("\n");
    begin = end + 1;
  }
  return trimmed;
}

}  // namespace plumbline::eval
