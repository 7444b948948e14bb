// The results of a folder as one file that other programs read. The columns stand in docs/results_schema.md. Both are
// there whole or not at all, and stream: results of any length pass through.
#pragma once

#include <filesystem>

namespace plumbline::tools {

// One row a run (RFC 4180). Numbers read back to the last bit; what is absent is empty.
void export_csv(const std::filesystem::path& results, const std::filesystem::path& file);

inline constexpr int kDatabaseVersion = 1;  // user_version; changes whenever a table does

// SQLite 3.
void export_sqlite(const std::filesystem::path& results, const std::filesystem::path& file);

}  // namespace plumbline::tools
