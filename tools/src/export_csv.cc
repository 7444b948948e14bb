#include <algorithm>
#include <cerrno>
#include <cmath>
#include <concepts>
#include <fstream>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

#include <fmt/format.h>

#include "core/atomic_file.h"
#include "results_folder.h"
#include "tools/export_results.h"

namespace plumbline::tools {
namespace {

using nlohmann::ordered_json;

// What some row holds of a metric.
struct MetricColumns {
  std::string name;
  bool nees = false;
  bool crlb = false;
  bool censored = false;
};

// In the order of their first rows.
std::vector<MetricColumns> metric_columns(const std::filesystem::path& results, std::size_t cells) {
  std::vector<MetricColumns> columns;
  for_each_result(results, cells, [&](const eval::Row& row) {
    for (const eval::Metric& metric : row.metrics) {
      auto column = std::ranges::find(columns, metric.name, &MetricColumns::name);
      if (column == columns.end()) column = columns.insert(column, {.name = metric.name});
      column->nees |= metric.nees.has_value();
      column->crlb |= metric.crlb.has_value();
      column->censored |= metric.censored;
    }
  });
  return columns;
}

std::vector<std::string> axis_columns(const std::vector<ordered_json>& cells) {
  std::vector<std::string> keys;
  for (const ordered_json& cell : cells) {
    for (const auto& axis : cell["axes"].items()) {
      if (std::ranges::find(keys, axis.key()) == keys.end()) keys.push_back(axis.key());
    }
  }
  return keys;
}

class CsvLine {
 public:
  void add(std::string_view field) {
    const bool quoted = field.find_first_of(",\"\r\n") != std::string_view::npos;
    if (quoted) text_ += '"';
    for (const char c : field) text_.append(c == '"' ? 2 : 1, c);
    if (quoted) text_ += '"';
    text_ += ',';
  }
  void add(const char* field) { add(std::string_view(field)); }
  void add(bool x) { add(x ? "true" : "false"); }
  void add(double x) { add(std::isfinite(x) ? fmt::format("{}", x) : std::string()); }
  template <std::integral Integer>
  void add(Integer x) {
    add(fmt::format("{}", x));
  }
  template <class T>
  void add(const std::optional<T>& x) {
    x ? add(*x) : add("");
  }

  std::string take() { return text_.substr(0, text_.size() - 1) + "\r\n"; }  // without the last comma

 private:
  std::string text_;
};

std::string header(const std::vector<std::string>& axes, const std::vector<MetricColumns>& metrics) {
  CsvLine line;
  for (const char* name : {"run_id", "cell", "trial", "seed", "ok", "status", "reason"}) line.add(name);
  for (const std::string& key : axes) line.add(key);
  for (const MetricColumns& m : metrics) {
    line.add(m.name);
    if (m.nees) line.add(m.name + ".nees");
    if (m.nees) line.add(m.name + ".nees_dof");
    if (m.crlb) line.add(m.name + ".crlb");
    if (m.censored) line.add(m.name + ".censored");
  }
  for (const char* name : {"iterations", "final_cost", "cost_per_dof", "observations", "landmarks"}) {
    line.add(std::string("solver.") + name);
  }
  return line.take();
}

std::string to_csv(const eval::Row& row, const std::vector<std::string>& axes, const ordered_json& values,
                   const std::vector<MetricColumns>& metrics) {
  CsvLine line;
  line.add(row.run_id);
  line.add(row.cell);
  line.add(row.trial);
  line.add(row.seed);
  line.add(row.ok);
  line.add(row.status);
  line.add(row.reason);
  for (const std::string& key : axes) {
    const ordered_json value = values.value(key, ordered_json(""));
    line.add(value.is_string() ? value.get<std::string>() : value.dump());
  }
  for (const MetricColumns& m : metrics) {
    const auto found = std::ranges::find(row.metrics, m.name, &eval::Metric::name);
    const bool is_there = found != row.metrics.end();
    const eval::Metric metric = is_there ? *found : eval::Metric{.name = m.name, .value = std::nan("")};
    line.add(metric.value);
    if (m.nees) line.add(metric.nees);
    if (m.nees) line.add(metric.nees ? std::optional(metric.nees_dof) : std::nullopt);
    if (m.crlb) line.add(metric.crlb);
    if (m.censored) line.add(is_there ? std::optional(metric.censored) : std::nullopt);
  }
  line.add(row.solver.iterations);
  line.add(row.solver.final_cost);
  line.add(row.solver.cost_per_dof);
  line.add(row.solver.observations);
  line.add(row.solver.landmarks);
  return line.take();
}

}  // namespace

void export_csv(const std::filesystem::path& results, const std::filesystem::path& file) {
  const std::vector<ordered_json> cells = read_cells(results);
  const std::vector<std::string> axes = axis_columns(cells);
  const std::vector<MetricColumns> metrics = metric_columns(results, cells.size());
  core::replace_file_atomically(file, [&](const std::filesystem::path& temporary) {
    std::ofstream out(temporary, std::ios::binary);
    out << header(axes, metrics);
    for_each_result(results, cells.size(), [&](const eval::Row& row) {
      out << to_csv(row, axes, cells[static_cast<std::size_t>(row.cell)]["axes"], metrics);
    });
    out.close();
    if (!out) throw std::system_error(errno, std::generic_category(), file.string() + ": cannot write");
  });
}

}  // namespace plumbline::tools
