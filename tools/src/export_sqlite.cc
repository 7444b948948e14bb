#include <SQLiteCpp/SQLiteCpp.h>
#include <SQLiteCpp/VariadicBind.h>
#include <fmt/format.h>
#include <sqlite3.h>

#include "core/atomic_file.h"
#include "core/error.h"
#include "results_folder.h"
#include "tools/export_results.h"

namespace plumbline::tools {
namespace {

using nlohmann::ordered_json;

// The seed is text, since SQLite's integers have a sign. An axis' value has the type that it has in the manifest.
constexpr const char* kTables = R"(
CREATE TABLE cells(cell INTEGER PRIMARY KEY, config_hash TEXT NOT NULL, config TEXT NOT NULL);
CREATE TABLE axes(cell INTEGER NOT NULL REFERENCES cells, key TEXT NOT NULL, value, PRIMARY KEY(cell, key)) WITHOUT ROWID;
CREATE TABLE runs(run_id TEXT PRIMARY KEY, cell INTEGER NOT NULL REFERENCES cells, trial INTEGER NOT NULL,
  seed TEXT NOT NULL, ok INTEGER NOT NULL, status TEXT NOT NULL, reason TEXT NOT NULL, iterations INTEGER NOT NULL,
  final_cost REAL, cost_per_dof REAL, observations INTEGER NOT NULL, landmarks INTEGER NOT NULL);
CREATE TABLE metrics(run_id TEXT NOT NULL REFERENCES runs, name TEXT NOT NULL, value REAL NOT NULL, nees REAL,
  nees_dof INTEGER, crlb REAL, censored INTEGER NOT NULL, PRIMARY KEY(run_id, name)) WITHOUT ROWID;
)";

void bind(SQLite::Statement& statement, int column, const std::optional<double>& x) {
  x ? statement.bind(column, *x) : statement.bind(column);
}

// A number, a word, or the JSON text of a list.
void bind(SQLite::Statement& statement, int column, const ordered_json& value) {
  if (value.is_number_integer()) return statement.bind(column, value.get<std::int64_t>());
  if (value.is_number()) return statement.bind(column, value.get<double>());
  statement.bind(column, value.is_string() ? value.get<std::string>() : value.dump());
}

void run_once(SQLite::Statement& statement) {
  statement.exec();
  statement.reset();
}

void insert_cells(SQLite::Database& database, const std::vector<ordered_json>& cells) {
  SQLite::Statement cell(database, "INSERT INTO cells VALUES(?, ?, ?)");
  SQLite::Statement axis(database, "INSERT INTO axes VALUES(?, ?, ?)");
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const int number = static_cast<int>(i);
    SQLite::bind(cell, number, cells[i]["config_hash"].get<std::string>(), cells[i]["config"].dump());
    run_once(cell);
    for (const auto& item : cells[i]["axes"].items()) {
      SQLite::bind(axis, number, item.key());
      bind(axis, 3, item.value());
      run_once(axis);
    }
  }
}

class RunInserter {
 public:
  explicit RunInserter(SQLite::Database& database)
      : run_(database, "INSERT INTO runs VALUES(?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)"),
        metric_(database, "INSERT INTO metrics VALUES(?, ?, ?, ?, ?, ?, ?)") {}

  // NaN binds as NULL.
  void add(const eval::Row& row) {
    const eval::SolverFigures& s = row.solver;
    SQLite::bind(run_, row.run_id, row.cell, row.trial, std::to_string(row.seed), row.ok ? 1 : 0, row.status,
                 row.reason, s.iterations, s.final_cost, s.cost_per_dof, s.observations, s.landmarks);
    run_once(run_);
    for (const eval::Metric& metric : row.metrics) {
      SQLite::bind(metric_, row.run_id, metric.name, metric.value);
      bind(metric_, 4, metric.nees);
      metric.nees ? metric_.bind(5, metric.nees_dof) : metric_.bind(5);
      bind(metric_, 6, metric.crlb);
      metric_.bind(7, metric.censored ? 1 : 0);
      run_once(metric_);
    }
  }

 private:
  SQLite::Statement run_;
  SQLite::Statement metric_;
};

}  // namespace

void export_sqlite(const std::filesystem::path& results, const std::filesystem::path& file) {
  const std::vector<ordered_json> cells = read_cells(results);
  core::replace_file_atomically(file, [&](const std::filesystem::path& temporary) {
    SQLite::Database database(temporary.string(), SQLite::OPEN_READWRITE | SQLite::OPEN_CREATE);
    // The file is synced and renamed once it is whole.
    database.exec("PRAGMA journal_mode = OFF; PRAGMA synchronous = OFF;");
    SQLite::Transaction transaction(database);
    database.exec(kTables);
    database.exec(fmt::format("PRAGMA user_version = {}", kDatabaseVersion));
    insert_cells(database, cells);
    RunInserter runs(database);
    for_each_result(results, cells.size(), [&](const eval::Row& row) {
      try {
        runs.add(row);
      } catch (const SQLite::Exception& error) {
        if (error.getErrorCode() != SQLITE_CONSTRAINT) throw;
        throw core::DataError(
            fmt::format("{}: run {} is there twice", (results / "results.jsonl").generic_string(), row.run_id));
      }
    });
    transaction.commit();
  });
}

}  // namespace plumbline::tools
