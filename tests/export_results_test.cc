// Exports of results: nothing lost, and docs/results_schema.md says what stands in each file.
#include "tools/export_results.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <string>
#include <vector>

#include <SQLiteCpp/SQLiteCpp.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "eval/result_store.h"
#include "eval/series.h"
#include "program_test.h"

namespace plumbline {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using Names = std::set<std::string>;
using nlohmann::ordered_json;

// The fields of a text of RFC 4180.
std::vector<std::vector<std::string>> parse_csv(const std::string& text) {
  std::vector<std::vector<std::string>> rows(1, std::vector<std::string>(1));
  bool quoted = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    std::string& field = rows.back().back();
    if (quoted) {
      if (text[i] != '"') {
        field += text[i];
      } else if (i + 1 < text.size() && text[i + 1] == '"') {
        field += text[++i];
      } else {
        quoted = false;
      }
    } else if (text[i] == '"') {
      quoted = true;
    } else if (text[i] == ',') {
      rows.back().emplace_back();
    } else if (text.compare(i, 2, "\r\n") == 0) {
      ++i;
      rows.emplace_back(1);
    } else {
      field += text[i];
    }
  }
  rows.pop_back();  // after the last line's end
  return rows;
}

// The words in backquotes that begin the rows of the page's table under a heading.
Names documented(const std::string& heading) {
  std::ifstream page(PLUMBLINE_SOURCE_DIR "/docs/results_schema.md");
  Names names;
  bool inside = false;
  for (std::string line; std::getline(page, line);) {
    if (line.starts_with("## ")) inside = line == "## " + heading;
    if (inside && line.starts_with("| `")) names.insert(line.substr(3, line.find('`', 3) - 3));
  }
  return names;
}

// "a.b" of every value that is no object; what lies below `metrics` is a NAME.
void collect(const ordered_json& json, const std::string& prefix, Names& names) {
  for (const auto& item : json.items()) {
    const std::string key = prefix + (prefix == "metrics." ? "NAME" : item.key());
    item.value().is_object() ? collect(item.value(), key + ".", names) : static_cast<void>(names.insert(key));
  }
}

// A run of two axes, one of them of lists, in which one trial failed.
class ExportResults : public ProgramTest {
 protected:
  void SetUp() override {
    ProgramTest::SetUp();
    fs::create_directories(folder_ / "out");
    const auto cell = [](const ordered_json& td, const ordered_json& position) {
      return ordered_json{{"axes", {{"scenario.camera.td_s", td}, {"scenario.camera.position", position}}},
                          {"config_hash", "abc"},
                          {"config", {{"scenario", 1}}}};
    };
    write("out/manifest.json", ordered_json{{"cells", {cell(0, {0.0, 0.5}), cell(0.02, {"a\"b"})}}}.dump());
    ok_ = {
        .run_id = "0123456789abcdef",
        .cell = 1,
        .trial = 4,
        .seed = 18446744073709551615U,
        .ok = true,
        .status = "converged",
        .reason = "",
        .metrics = {{.name = "td_error_s", .value = -1.0 / 3.0, .nees = 1e-300, .nees_dof = 1, .crlb = 0.1},
                    {.name = "td_convergence_s", .value = 2.0, .censored = true}},
        .solver = {.iterations = 7, .final_cost = 2.0 / 3.0, .cost_per_dof = 1.0, .observations = 8, .landmarks = 9}};
    failed_ = {.run_id = "fedcba9876543210",
               .cell = 0,
               .trial = 0,
               .seed = 3,
               .ok = false,
               .status = "exception",
               .reason = "line 1, \"x\"\nline 2",
               .metrics = {},
               .solver = {.final_cost = std::nan(""), .cost_per_dof = std::nan("")}};
    write("out/results.jsonl", eval::to_line(failed_) + "\n" + eval::to_line(ok_) + "\n");
  }

  eval::Row ok_;
  eval::Row failed_;
};

TEST_F(ExportResults, CsvHoldsEveryRowToTheLastBit) {
  const ProgramResult result = plumbline("export-results out --format csv --out rows.csv");
  ASSERT_EQ(result.code, 0) << result.err;
  const auto rows = parse_csv(read(folder_ / "rows.csv"));
  ASSERT_EQ(rows.size(), 3U);
  const std::vector<std::string> header = {"run_id",
                                           "cell",
                                           "trial",
                                           "seed",
                                           "ok",
                                           "status",
                                           "reason",
                                           "scenario.camera.td_s",
                                           "scenario.camera.position",
                                           "td_error_s",
                                           "td_error_s.nees",
                                           "td_error_s.nees_dof",
                                           "td_error_s.crlb",
                                           "td_convergence_s",
                                           "td_convergence_s.censored",
                                           "solver.iterations",
                                           "solver.final_cost",
                                           "solver.cost_per_dof",
                                           "solver.observations",
                                           "solver.landmarks"};
  EXPECT_EQ(rows[0], header);
  const std::vector<std::string> failed = {"fedcba9876543210",
                                           "0",
                                           "0",
                                           "3",
                                           "false",
                                           "exception",
                                           failed_.reason,
                                           "0",
                                           "[0.0,0.5]",
                                           "",
                                           "",
                                           "",
                                           "",
                                           "",
                                           "",
                                           "0",
                                           "",
                                           "",
                                           "0",
                                           "0"};
  EXPECT_EQ(rows[1], failed);
  const std::vector<std::string> ok = {"0123456789abcdef",
                                       "1",
                                       "4",
                                       "18446744073709551615",
                                       "true",
                                       "converged",
                                       "",
                                       "0.02",
                                       "[\"a\\\"b\"]",
                                       "-0.3333333333333333",
                                       "1e-300",
                                       "1",
                                       "0.1",
                                       "2",
                                       "true",
                                       "7",
                                       "0.6666666666666666",
                                       "1",
                                       "8",
                                       "9"};
  EXPECT_EQ(rows[2], ok);
  EXPECT_EQ(std::stod(rows[2][9]), -1.0 / 3.0);
}

TEST_F(ExportResults, SqliteHoldsEveryRowToTheLastBit) {
  const ProgramResult result = plumbline("export-results out --format sqlite --out rows.db");
  ASSERT_EQ(result.code, 0) << result.err;
  SQLite::Database database((folder_ / "rows.db").string());
  const auto get = [&](const std::string& sql) { return database.execAndGet(sql); };
  EXPECT_EQ(get("PRAGMA user_version").getInt(), tools::kDatabaseVersion);
  EXPECT_EQ(get("PRAGMA integrity_check").getString(), "ok");
  EXPECT_EQ(get("SELECT count(*) FROM runs").getInt(), 2);
  EXPECT_EQ(get("SELECT count(*) FROM metrics").getInt(), 2);
  EXPECT_EQ(get("SELECT seed FROM runs WHERE cell = 1").getString(), "18446744073709551615");
  EXPECT_EQ(get("SELECT final_cost FROM runs WHERE ok").getDouble(), 2.0 / 3.0);
  EXPECT_TRUE(get("SELECT final_cost FROM runs WHERE NOT ok").isNull());
  EXPECT_EQ(get("SELECT reason FROM runs WHERE NOT ok").getString(), failed_.reason);
  EXPECT_EQ(get("SELECT value FROM metrics WHERE name = 'td_error_s'").getDouble(), -1.0 / 3.0);
  EXPECT_EQ(get("SELECT nees FROM metrics WHERE name = 'td_error_s'").getDouble(), 1e-300);
  EXPECT_EQ(get("SELECT crlb FROM metrics WHERE name = 'td_error_s'").getDouble(), 0.1);
  EXPECT_TRUE(get("SELECT nees_dof FROM metrics WHERE name = 'td_convergence_s'").isNull());
  EXPECT_EQ(get("SELECT censored FROM metrics WHERE name = 'td_convergence_s'").getInt(), 1);
  EXPECT_EQ(get("SELECT value FROM axes WHERE cell = 1 AND key = 'scenario.camera.td_s'").getDouble(), 0.02);
  EXPECT_EQ(get("SELECT json_extract(config, '$.scenario') FROM cells WHERE cell = 0").getInt(), 1);
}

TEST_F(ExportResults, ReplacesAFileOrLeavesItAsItWas) {
  for (const std::string format : {"csv", "sqlite"}) {
    const std::string command = "export-results out --format " + format + " --out rows";
    write("rows", "before");
    write("out/results.jsonl", eval::to_line(ok_) + "\n" + eval::to_line(failed_));
    const ProgramResult torn = plumbline(command);
    EXPECT_EQ(torn.code, 2);
    EXPECT_THAT(torn.err, HasSubstr("out/results.jsonl:2: the last line is not complete"));
    EXPECT_EQ(read(folder_ / "rows"), "before");
    EXPECT_EQ(std::ranges::count_if(fs::directory_iterator(folder_), [](const auto&) { return true; }), 2);
    write("out/results.jsonl", eval::to_line(ok_) + "\n");
    EXPECT_EQ(plumbline(command).code, 0);
    const std::string first = read(folder_ / "rows");
    EXPECT_NE(first, "before");
    EXPECT_EQ(plumbline(command).code, 0);
    EXPECT_EQ(read(folder_ / "rows"), first);  // the same bytes
    EXPECT_EQ(plumbline("export-results out --format " + format + " --out out").code, 2);
  }
}

TEST_F(ExportResults, BadInputIsNamed) {
  const auto refusal = [&](const std::string& arguments) {
    const ProgramResult result = plumbline("export-results " + arguments);
    EXPECT_EQ(result.code, 2) << arguments;
    EXPECT_FALSE(fs::exists(folder_ / "rows")) << arguments;
    return result.err;
  };
  EXPECT_THAT(refusal("nowhere --format csv --out rows"), HasSubstr("nowhere/manifest.json: no such file"));
  EXPECT_THAT(refusal("out --format xls --out rows"), HasSubstr("xls"));
  write("out/results.jsonl", eval::to_line(ok_) + "\n" + eval::to_line(ok_) + "\n");
  EXPECT_THAT(refusal("out --format sqlite --out rows"), HasSubstr("run 0123456789abcdef is there twice"));
  write("out/manifest.json", R"({"cells": [{"axes": {}, "config_hash": 3, "config": {}}]})");
  EXPECT_THAT(refusal("out --format csv --out rows"), HasSubstr("out/manifest.json: cells: each needs axes"));
  write("out/manifest.json", R"({"cells": [{"axes": {}, "config_hash": "abc", "config": {}}]})");
  EXPECT_THAT(refusal("out --format sqlite --out rows"), HasSubstr("run 0123456789abcdef: no cell 1"));
}

TEST_F(ExportResults, ThePageHasEveryColumn) {
  ASSERT_EQ(plumbline("export-results out --format csv --out rows.csv").code, 0);
  Names csv;
  const auto rows = parse_csv(read(folder_ / "rows.csv"));
  for (const std::string& column : rows[0]) {
    const std::string name = column.starts_with("scenario.") ? "KEY" : column;
    const bool of_metric = name.starts_with("td_");
    csv.insert(of_metric ? "NAME" + (name.find('.') == std::string::npos ? "" : name.substr(name.find('.'))) : name);
  }
  EXPECT_EQ(csv, documented("CSV"));

  ASSERT_EQ(plumbline("export-results out --format sqlite --out rows.db").code, 0);
  SQLite::Database database((folder_ / "rows.db").string());
  SQLite::Statement columns(database,
                            "SELECT m.name || '.' || c.name FROM sqlite_master m, pragma_table_info(m.name) c "
                            "WHERE m.type = 'table'");
  Names sqlite;
  while (columns.executeStep()) sqlite.insert(columns.getColumn(0).getString());
  EXPECT_EQ(sqlite, documented("SQLite"));
}

TEST_F(ExportResults, ThePageHasEveryKeyOfTheFiles) {
  write("x.yaml",
        "scenario:\n  duration_s: 2\n  world: {landmarks: 1000}\n  points: {per_frame: 20}\n"
        "  imu: {gyro_noise_density_rad_s_sqrt_hz: 1.7e-4, gyro_bias_walk_rad_s2_sqrt_hz: 2.0e-5, "
        "accel_noise_density_m_s2_sqrt_hz: 2.0e-3, accel_bias_walk_m_s3_sqrt_hz: 3.0e-3}\n");
  const ProgramResult result = plumbline("run x.yaml --out ran");
  ASSERT_EQ(result.code, 0) << result.err;
  const auto keys = [](const std::string& json) {
    Names names;
    collect(ordered_json::parse(json), "", names);
    return names;
  };
  EXPECT_EQ(keys(read(folder_ / "ran/timings.jsonl")), documented("`timings.jsonl`"));

  // All that a row and a series can hold.
  for (eval::Metric& metric : ok_.metrics) metric.censored = true;
  EXPECT_EQ(keys(eval::to_line(ok_)), documented("`results.jsonl`"));
  EXPECT_EQ(keys(eval::to_json(eval::Series{{}, {{}}, {{}}, {{}}}).dump()), documented("`series/RUN_ID.json`"));
}

}  // namespace
}  // namespace plumbline
