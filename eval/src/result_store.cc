#include "eval/result_store.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <stdexcept>
#include <type_traits>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "core/error.h"

namespace plumbline::eval {
namespace {

using core::DataError;
using nlohmann::ordered_json;

void require_keys(const ordered_json& object, const std::vector<std::string_view>& keys, const std::string& where) {
  if (!object.is_object()) throw DataError(where + ": must be an object");
  for (const std::string_view key : keys) {
    if (!object.contains(key)) throw DataError(fmt::format("{}: {}: missing", where, key));
  }
  for (const auto& item : object.items()) {
    if (std::find(keys.begin(), keys.end(), item.key()) == keys.end()) {
      throw DataError(fmt::format("{}: {}: unknown key", where, item.key()));
    }
  }
}

template <class T>
T get(const ordered_json& object, const char* key, const std::string& where) {
  const ordered_json& value = object.at(key);
  if constexpr (std::is_same_v<T, bool>) {
    if (value.is_boolean()) return value.get<bool>();
  } else if constexpr (std::is_same_v<T, std::string>) {
    if (value.is_string()) return value.get<std::string>();
  } else if constexpr (std::is_same_v<T, double>) {
    if (value.is_number()) return value.get<double>();
  } else if constexpr (std::is_unsigned_v<T>) {
    if (value.is_number_unsigned()) return value.get<T>();
  } else {
    if (value.is_number_unsigned() && value.get<std::uint64_t>() <= std::numeric_limits<T>::max()) {
      return value.get<T>();
    }
  }
  throw DataError(fmt::format("{}: {}: wrong type or out of range", where, key));
}

double get_figure(const ordered_json& object, const char* key, bool may_be_null, const std::string& where) {
  if (may_be_null && object.at(key).is_null()) return std::numeric_limits<double>::quiet_NaN();
  return get<double>(object, key, where);
}

ordered_json to_json(const Metric& metric) {
  ordered_json json = {{"value", metric.value}};
  if (metric.nees) {
    json["nees"] = *metric.nees;
    json["nees_dof"] = metric.nees_dof;
  }
  if (metric.crlb) json["crlb"] = *metric.crlb;
  if (metric.censored) json["censored"] = true;
  return json;
}

Metric parse_metric(const std::string& name, const ordered_json& json, const std::string& where) {
  const std::string here = fmt::format("{}: metrics.{}", where, name);
  const bool has_nees = json.is_object() && (json.contains("nees") || json.contains("nees_dof"));
  const bool has_crlb = json.is_object() && json.contains("crlb");
  const bool is_censored = json.is_object() && json.contains("censored");
  std::vector<std::string_view> keys = {"value"};
  if (has_nees) keys.insert(keys.end(), {"nees", "nees_dof"});
  if (has_crlb) keys.emplace_back("crlb");
  if (is_censored) keys.emplace_back("censored");
  require_keys(json, keys, here);
  Metric metric{name, get<double>(json, "value", here)};
  if (has_nees) {
    metric.nees = get<double>(json, "nees", here);
    metric.nees_dof = get<int>(json, "nees_dof", here);
  }
  if (has_crlb) metric.crlb = get<double>(json, "crlb", here);
  if (is_censored) metric.censored = get<bool>(json, "censored", here);
  return metric;
}

bool is_finite(const Row& row) {
  return std::isfinite(row.solver.final_cost) && std::isfinite(row.solver.cost_per_dof) &&
         std::all_of(row.metrics.begin(), row.metrics.end(), [](const Metric& metric) {
           return std::isfinite(metric.value) && std::isfinite(metric.nees.value_or(0.0)) &&
                  std::isfinite(metric.crlb.value_or(0.0));
         });
}

}  // namespace

Row with_result(Row row, const TrialResult& result) {
  row.ok = result.ok;
  row.status = result.status;
  row.reason = result.reason;
  row.metrics = result.metrics;
  row.solver = result.solver;
  return row;
}

std::string to_line(const Row& row) {
  if (row.ok && !is_finite(row)) throw std::logic_error(row.run_id + ": an ok run holds a value that is not finite");
  ordered_json metrics = ordered_json::object();
  for (const Metric& metric : row.metrics) metrics[metric.name] = to_json(metric);
  const SolverFigures& solver = row.solver;
  const ordered_json json = {{"run_id", row.run_id},
                             {"cell", row.cell},
                             {"trial", row.trial},
                             {"seed", row.seed},
                             {"ok", row.ok},
                             {"status", row.status},
                             {"reason", row.reason},
                             {"metrics", std::move(metrics)},
                             {"solver",
                              {{"iterations", solver.iterations},
                               {"final_cost", solver.final_cost},
                               {"cost_per_dof", solver.cost_per_dof},
                               {"observations", solver.observations},
                               {"landmarks", solver.landmarks}}}};
  // A reason may quote bytes that are not UTF-8; they must not cost the row.
  return json.dump(-1, ' ', false, ordered_json::error_handler_t::replace);
}

Row parse_row(std::string_view line, const std::string& where) {
  const ordered_json json = ordered_json::parse(line, nullptr, false);
  if (json.is_discarded()) throw DataError(where + ": not JSON");
  require_keys(json, {"run_id", "cell", "trial", "seed", "ok", "status", "reason", "metrics", "solver"}, where);
  Row row{.run_id = get<std::string>(json, "run_id", where),
          .cell = get<int>(json, "cell", where),
          .trial = get<int>(json, "trial", where),
          .seed = get<std::uint64_t>(json, "seed", where),
          .ok = get<bool>(json, "ok", where),
          .status = get<std::string>(json, "status", where),
          .reason = get<std::string>(json, "reason", where),
          .metrics = {},
          .solver = {}};
  const ordered_json& metrics = json.at("metrics");
  if (!metrics.is_object()) throw DataError(where + ": metrics: must be an object");
  for (const auto& item : metrics.items()) row.metrics.push_back(parse_metric(item.key(), item.value(), where));

  const ordered_json& solver = json.at("solver");
  const std::string here = where + ": solver";
  require_keys(solver, {"iterations", "final_cost", "cost_per_dof", "observations", "landmarks"}, here);
  row.solver = {.iterations = get<int>(solver, "iterations", here),
                .final_cost = get_figure(solver, "final_cost", !row.ok, here),
                .cost_per_dof = get_figure(solver, "cost_per_dof", !row.ok, here),
                .observations = get<int>(solver, "observations", here),
                .landmarks = get<int>(solver, "landmarks", here)};
  return row;
}

void for_each_row(const std::filesystem::path& path, const std::function<void(const Row&)>& use) {
  std::ifstream file(path, std::ios::binary);
  if (!file) throw DataError(path.string() + ": no such file, or not readable");
  std::string line;
  for (int number = 1; std::getline(file, line); ++number) {
    const std::string where = fmt::format("{}:{}", path.string(), number);
    if (file.eof()) {  // getline met the end of the file before the end of the line
      throw DataError(where + ": the last line is not complete");
    }
    use(parse_row(line, where));
  }
}

}  // namespace plumbline::eval
