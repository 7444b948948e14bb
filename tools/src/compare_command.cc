#include <fstream>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "core/error.h"
#include "eval/comparison.h"
#include "tools/commands.h"

namespace plumbline::tools {
namespace {

// The rows of a results folder by cell, with the axes from its manifest.
std::vector<eval::CellOutcomes> read_outcomes(const std::filesystem::path& folder) {
  const std::filesystem::path file = folder / "manifest.json";
  const std::string where = file.generic_string();
  std::ifstream stream(file);
  if (!stream) throw core::DataError(where + ": no such file, or not readable");
  const auto manifest = nlohmann::ordered_json::parse(stream, nullptr, false);
  if (!manifest.is_object() || !manifest.contains("cells") || !manifest["cells"].is_array()) {
    throw core::DataError(where + ": is no manifest with cells");
  }
  std::vector<eval::CellOutcomes> cells;
  for (const auto& cell : manifest["cells"]) {
    if (!cell.is_object() || !cell.contains("axes")) throw core::DataError(where + ": cells: axes: missing");
    eval::CellOutcomes& outcomes = cells.emplace_back();
    outcomes.axes = cell["axes"];
  }
  eval::for_each_row(folder / "results.jsonl", eval::Tail::kWhole, [&](const eval::Row& row) {
    if (static_cast<std::size_t>(row.cell) >= cells.size()) {
      throw core::DataError(fmt::format("{}: run {}: no cell {} in {}", (folder / "results.jsonl").generic_string(),
                                        row.run_id, row.cell, where));
    }
    cells[static_cast<std::size_t>(row.cell)].add(row);
  });
  return cells;
}

}  // namespace

int compare(const CompareOptions& options) {
  const eval::Comparison comparison =
      eval::compare(read_outcomes(options.a), read_outcomes(options.b), options.metrics, options.alpha);
  if (options.json) {
    fmt::print("{}\n", eval::to_json(comparison).dump(2));
  } else {
    fmt::print("A {}\nB {}\n\n{}", options.a.generic_string(), options.b.generic_string(),
               eval::comparison_table(comparison));
  }
  return comparison.worse ? kExitWorse : kExitOk;
}

}  // namespace plumbline::tools
