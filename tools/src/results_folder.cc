#include "results_folder.h"

#include <fstream>

#include <fmt/format.h>

#include "core/error.h"

namespace plumbline::tools {

std::vector<nlohmann::ordered_json> read_cells(const std::filesystem::path& folder) {
  const std::string where = (folder / "manifest.json").generic_string();
  std::ifstream stream(where);
  if (!stream) throw core::DataError(where + ": no such file, or not readable");
  const auto manifest = nlohmann::ordered_json::parse(stream, nullptr, false);
  if (!manifest.is_object() || !manifest.contains("cells") || !manifest["cells"].is_array()) {
    throw core::DataError(where + ": is no manifest with cells");
  }
  for (const auto& cell : manifest["cells"]) {
    const bool is_sound = cell.is_object() && cell.contains("config") && cell.contains("axes") &&
                          cell["axes"].is_object() && cell.contains("config_hash") && cell["config_hash"].is_string();
    if (!is_sound) throw core::DataError(where + ": cells: each needs axes (a map), config_hash (text) and config");
  }
  return manifest["cells"];
}

void for_each_result(const std::filesystem::path& folder, std::size_t cells,
                     const std::function<void(const eval::Row&)>& use) {
  const std::filesystem::path results = folder / "results.jsonl";
  eval::for_each_row(results, [&](const eval::Row& row) {
    if (static_cast<std::size_t>(row.cell) >= cells) {
      throw core::DataError(fmt::format("{}: run {}: no cell {} in {}", results.generic_string(), row.run_id, row.cell,
                                        (folder / "manifest.json").generic_string()));
    }
    use(row);
  });
}

}  // namespace plumbline::tools
