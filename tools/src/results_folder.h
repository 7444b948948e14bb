// What `plumbline run` left in a folder (docs/results_schema.md), for those who take its configurations as they stand.
#pragma once

#include <filesystem>
#include <functional>
#include <vector>

#include <nlohmann/json.hpp>

#include "eval/result_store.h"

namespace plumbline::tools {

// The cells of its manifest.json: {"axes", "config_hash", "config"} each. Throws core::DataError.
std::vector<nlohmann::ordered_json> read_cells(const std::filesystem::path& folder);

// Each row of its results.jsonl, which must be of one of `cells` cells.
void for_each_result(const std::filesystem::path& folder, std::size_t cells,
                     const std::function<void(const eval::Row&)>& use);

}  // namespace plumbline::tools
