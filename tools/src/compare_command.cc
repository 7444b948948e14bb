#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "eval/comparison.h"
#include "results_folder.h"
#include "tools/commands.h"

namespace plumbline::tools {
namespace {

// The rows of a results folder by cell, with the axes from its manifest.
std::vector<eval::CellOutcomes> read_outcomes(const std::filesystem::path& folder) {
  std::vector<eval::CellOutcomes> cells;
  for (const auto& cell : read_cells(folder)) cells.emplace_back().axes = cell["axes"];
  for_each_result(folder, cells.size(),
                  [&](const eval::Row& row) { cells[static_cast<std::size_t>(row.cell)].add(row); });
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
