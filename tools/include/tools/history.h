// What the nights found: an SQLite file that grows by one transaction a night. Write-ahead log, synced; a writer waits
// for another one up to a minute; killed at any moment, it holds whole nights only. `user_version` is the schema's
// version: an older file is brought up to date in one transaction, a newer one refused. Tables: docs/nightly.md.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "eval/gates.h"
#include "eval/result_store.h"

namespace SQLite {  // NOLINT(readability-identifier-naming): of SQLiteCpp
class Database;
}

namespace plumbline::tools {

inline constexpr int kHistoryVersion = 2;

// A cell of an experiment in one night.
struct NightCell {
  std::string experiment;
  nlohmann::ordered_json axes;
  std::string config_hash;
  std::string pairing_hash;  // of seed, scenario and evaluation: the same where trials may be paired
  nlohmann::ordered_json config;
  std::vector<eval::Row> fixed;  // by trial
  std::vector<eval::Row> fresh;
  std::vector<double> estimate_s;  // processor time of the estimator, of `fixed`
};

struct Night {
  std::int64_t id = 0;  // given by the history
  std::string started;  // UTC, "2026-11-26 20:45:00"
  std::string commit;
  std::string version;
  std::string suite_hash;  // of the suite's rules and experiments
  bool quick = false;
  std::uint64_t fresh_seed = 0;
  std::optional<std::int64_t> baseline;
  bool red = false;
  std::string tag;  // a name to find it by; a later night may take it over
  std::vector<std::pair<std::string, std::string>> provenance;
  std::vector<NightCell> cells;
  std::vector<eval::Gate> gates;
};

// The RMSE of a metric over the fixed trials of a cell that are ok.
struct TrendPoint {
  std::int64_t night = 0;
  std::string started;
  std::string commit;
  bool red = false;
  std::string experiment;
  std::string axes;  // JSON
  std::string metric;
  double rmse = 0.0;
  int n = 0;
};

class History {
 public:
  // Makes the file where it is not there. Throws core::DataError where it is no history, or a newer one.
  explicit History(const std::filesystem::path& file);
  ~History();

  // Returns its id.
  std::int64_t add(const Night& night);

  // "last_green", a tag, or the beginning of a commit: the latest night that it fits, quick ones apart from whole ones.
  std::optional<std::int64_t> find(const std::string& reference, bool quick) const;

  Night load(std::int64_t id) const;  // without gates

  std::vector<TrendPoint> trends(bool quick, int nights) const;

 private:
  std::unique_ptr<SQLite::Database> database_;
};

}  // namespace plumbline::tools
