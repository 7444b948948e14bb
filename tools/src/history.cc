#include "tools/history.h"

#include <array>
#include <cmath>

#include <SQLiteCpp/SQLiteCpp.h>
#include <SQLiteCpp/VariadicBind.h>
#include <fmt/format.h>
#include <sqlite3.h>

#include "core/error.h"

namespace plumbline::tools {
namespace {

using nlohmann::ordered_json;

constexpr int kWaitMs = 60'000;

// kMigrations[v] brings a file of version v to v + 1. Seeds are text, since SQLite's integers have a sign.
constexpr std::array<const char*, kHistoryVersion> kMigrations = {R"(
CREATE TABLE nights(night INTEGER PRIMARY KEY, started TEXT NOT NULL, commit_id TEXT NOT NULL, version TEXT NOT NULL,
  suite_hash TEXT NOT NULL, quick INTEGER NOT NULL, fresh_seed TEXT NOT NULL, baseline INTEGER REFERENCES nights,
  red INTEGER NOT NULL);
CREATE TABLE provenance(night INTEGER NOT NULL REFERENCES nights, name TEXT NOT NULL, text TEXT NOT NULL,
  PRIMARY KEY(night, name)) WITHOUT ROWID;
CREATE TABLE cells(cell INTEGER PRIMARY KEY, night INTEGER NOT NULL REFERENCES nights, experiment TEXT NOT NULL,
  axes TEXT NOT NULL, config_hash TEXT NOT NULL, pairing_hash TEXT NOT NULL, config TEXT NOT NULL);
CREATE TABLE runs(run INTEGER PRIMARY KEY, cell INTEGER NOT NULL REFERENCES cells, fresh INTEGER NOT NULL,
  trial INTEGER NOT NULL, seed TEXT NOT NULL, run_id TEXT NOT NULL, ok INTEGER NOT NULL, status TEXT NOT NULL,
  reason TEXT NOT NULL, estimate_s REAL);
CREATE TABLE metrics(run INTEGER NOT NULL REFERENCES runs, name TEXT NOT NULL, value REAL NOT NULL, nees REAL,
  nees_dof INTEGER, crlb REAL, PRIMARY KEY(run, name)) WITHOUT ROWID;
CREATE INDEX cells_of_night ON cells(night);
CREATE INDEX runs_of_cell ON runs(cell);
)",
                                                                  R"(
CREATE TABLE gates(night INTEGER NOT NULL REFERENCES nights, experiment TEXT NOT NULL, axes TEXT NOT NULL,
  kind TEXT NOT NULL, name TEXT NOT NULL, verdict TEXT NOT NULL, message TEXT NOT NULL, ratio REAL, p REAL);
CREATE INDEX gates_of_night ON gates(night);
CREATE TABLE tags(name TEXT PRIMARY KEY, night INTEGER NOT NULL REFERENCES nights) WITHOUT ROWID;
)"};

int version_of(SQLite::Database& database) { return database.execAndGet("PRAGMA user_version").getInt(); }

void migrate(SQLite::Database& database, const std::string& where) {
  SQLite::Transaction transaction(database, SQLite::TransactionBehavior::IMMEDIATE);
  const int version = version_of(database);
  if (version > kHistoryVersion) {
    throw core::DataError(
        fmt::format("{}: schema {} is of a newer Plumbline; this one knows {}", where, version, kHistoryVersion));
  }
  if (version == 0 && database.execAndGet("SELECT count(*) FROM sqlite_master").getInt() > 0) {
    throw core::DataError(fmt::format("{}: is a database of something else", where));
  }
  for (int v = version; v < kHistoryVersion; ++v) database.exec(kMigrations[static_cast<std::size_t>(v)]);
  database.exec(fmt::format("PRAGMA user_version = {}", kHistoryVersion));
  transaction.commit();
}

void bind_optional(SQLite::Statement& statement, int column, const std::optional<double>& x) {
  x ? statement.bind(column, *x) : statement.bind(column);
}

void execute(SQLite::Statement& statement) {
  statement.exec();
  statement.reset();
}

class RunWriter {
 public:
  explicit RunWriter(SQLite::Database& database)
      : database_(database),
        run_(database,
             "INSERT INTO runs(cell, fresh, trial, seed, run_id, ok, status, reason, estimate_s) "
             "VALUES(?, ?, ?, ?, ?, ?, ?, ?, ?)"),
        metric_(database, "INSERT INTO metrics VALUES(?, ?, ?, ?, ?, ?)") {}

  void add(std::int64_t cell, bool fresh, const eval::Row& row, const std::optional<double>& estimate_s) {
    SQLite::bind(run_, cell, fresh ? 1 : 0, row.trial, std::to_string(row.seed), row.run_id, row.ok ? 1 : 0, row.status,
                 row.reason);
    bind_optional(run_, 9, estimate_s);
    execute(run_);
    const std::int64_t run = database_.getLastInsertRowid();
    for (const eval::Metric& m : row.metrics) {
      SQLite::bind(metric_, run, m.name, m.value);
      bind_optional(metric_, 4, m.nees);
      m.nees ? metric_.bind(5, m.nees_dof) : metric_.bind(5);
      bind_optional(metric_, 6, m.crlb);
      execute(metric_);
    }
  }

 private:
  SQLite::Database& database_;
  SQLite::Statement run_;
  SQLite::Statement metric_;
};

void write_cells(SQLite::Database& database, std::int64_t id, const std::vector<NightCell>& cells) {
  SQLite::Statement insert(
      database,
      "INSERT INTO cells(night, experiment, axes, config_hash, pairing_hash, config) VALUES(?, ?, ?, ?, ?, ?)");
  RunWriter runs(database);
  for (const NightCell& cell : cells) {
    SQLite::bind(insert, id, cell.experiment, cell.axes.dump(), cell.config_hash, cell.pairing_hash,
                 cell.config.dump());
    execute(insert);
    const std::int64_t number = database.getLastInsertRowid();
    for (std::size_t i = 0; i < cell.fixed.size(); ++i) {
      const bool timed = i < cell.estimate_s.size();
      runs.add(number, false, cell.fixed[i], timed ? std::optional(cell.estimate_s[i]) : std::nullopt);
    }
    for (const eval::Row& row : cell.fresh) runs.add(number, true, row, std::nullopt);
  }
}

void write_gates(SQLite::Database& database, std::int64_t id, const std::vector<eval::Gate>& gates) {
  SQLite::Statement insert(database, "INSERT INTO gates VALUES(?, ?, ?, ?, ?, ?, ?, ?, ?)");
  for (const eval::Gate& gate : gates) {
    SQLite::bind(insert, id, gate.experiment, gate.axes.dump(),
                 std::string(eval::kGateKindNames[static_cast<std::size_t>(gate.kind)]), gate.name,
                 std::string(eval::kGateVerdictNames[static_cast<std::size_t>(gate.verdict)]), gate.message);
    bind_optional(insert, 8, gate.comparison ? std::optional(gate.comparison->ratio) : std::nullopt);
    bind_optional(insert, 9, gate.comparison ? std::optional(gate.comparison->p_holm) : std::nullopt);
    execute(insert);
  }
}

std::vector<eval::Metric> read_metrics(SQLite::Statement& select, std::int64_t run) {
  std::vector<eval::Metric> metrics;
  select.reset();
  select.bind(1, run);
  while (select.executeStep()) {
    eval::Metric m{.name = select.getColumn(0).getString(), .value = select.getColumn(1).getDouble()};
    if (!select.getColumn(2).isNull()) {
      m.nees = select.getColumn(2).getDouble();
      m.nees_dof = select.getColumn(3).getInt();
    }
    if (!select.getColumn(4).isNull()) m.crlb = select.getColumn(4).getDouble();
    metrics.push_back(std::move(m));
  }
  return metrics;
}

void read_runs(SQLite::Database& database, std::int64_t number, NightCell& cell) {
  SQLite::Statement runs(database,
                         "SELECT run, fresh, trial, seed, run_id, ok, status, reason, estimate_s FROM runs WHERE "
                         "cell = ? ORDER BY fresh, trial");
  SQLite::Statement metrics(database,
                            "SELECT name, value, nees, nees_dof, crlb FROM metrics WHERE run = ? ORDER BY name");
  runs.bind(1, number);
  while (runs.executeStep()) {
    eval::Row row;
    row.trial = runs.getColumn(2).getInt();
    row.seed = std::stoull(runs.getColumn(3).getString());
    row.run_id = runs.getColumn(4).getString();
    row.ok = runs.getColumn(5).getInt() != 0;
    row.status = runs.getColumn(6).getString();
    row.reason = runs.getColumn(7).getString();
    row.metrics = read_metrics(metrics, runs.getColumn(0).getInt64());
    const bool fresh = runs.getColumn(1).getInt() != 0;
    if (!fresh && !runs.getColumn(8).isNull()) cell.estimate_s.push_back(runs.getColumn(8).getDouble());
    (fresh ? cell.fresh : cell.fixed).push_back(std::move(row));
  }
}

}  // namespace

History::History(const std::filesystem::path& file) {
  const std::string where = file.generic_string();
  try {
    database_ = std::make_unique<SQLite::Database>(where, SQLite::OPEN_READWRITE | SQLite::OPEN_CREATE, kWaitMs);
    migrate(*database_, where);
    database_->exec("PRAGMA journal_mode = WAL; PRAGMA synchronous = FULL; PRAGMA foreign_keys = ON;");
  } catch (const SQLite::Exception& error) {
    const bool unreadable = error.getErrorCode() == SQLITE_NOTADB || error.getErrorCode() == SQLITE_CANTOPEN;
    if (!unreadable) throw;
    throw core::DataError(fmt::format("{}: {}", where, error.what()));
  }
}

History::~History() = default;

std::int64_t History::add(const Night& night) {
  SQLite::Database& database = *database_;
  SQLite::Transaction transaction(database, SQLite::TransactionBehavior::IMMEDIATE);
  SQLite::Statement insert(database,
                           "INSERT INTO nights(started, commit_id, version, suite_hash, quick, fresh_seed, red, "
                           "baseline) VALUES(?, ?, ?, ?, "
                           "?, ?, ?, ?)");
  SQLite::bind(insert, night.started, night.commit, night.version, night.suite_hash, night.quick ? 1 : 0,
               std::to_string(night.fresh_seed), night.red ? 1 : 0);
  night.baseline ? insert.bind(8, *night.baseline) : insert.bind(8);
  execute(insert);
  const std::int64_t id = database.getLastInsertRowid();
  SQLite::Statement provenance(database, "INSERT INTO provenance VALUES(?, ?, ?)");
  for (const auto& [name, text] : night.provenance) {
    SQLite::bind(provenance, id, name, text);
    execute(provenance);
  }
  write_cells(database, id, night.cells);
  write_gates(database, id, night.gates);
  if (!night.tag.empty()) {
    SQLite::Statement tag(database, "INSERT OR REPLACE INTO tags VALUES(?, ?)");
    SQLite::bind(tag, night.tag, id);
    execute(tag);
  }
  transaction.commit();
  return id;
}

std::optional<std::int64_t> History::find(const std::string& reference, bool quick) const {
  const auto latest = [&](const char* where) -> std::optional<std::int64_t> {
    SQLite::Statement select(*database_,
                             fmt::format("SELECT night FROM nights LEFT JOIN tags USING(night) WHERE quick = "
                                         "?1 AND {} ORDER BY night DESC LIMIT 1",
                                         where));
    select.bind(1, quick ? 1 : 0);
    if (select.getBindParameterCount() > 1) select.bind(2, reference);
    return select.executeStep() ? std::optional(select.getColumn(0).getInt64()) : std::nullopt;
  };
  if (reference == "last_green") return latest("red = 0");
  const auto tagged = latest("name = ?2");
  return tagged ? tagged : latest("substr(commit_id, 1, length(?2)) = ?2");
}

Night History::load(std::int64_t id) const {
  Night night;
  SQLite::Statement select(
      *database_,
      "SELECT started, commit_id, version, suite_hash, quick, fresh_seed, red, baseline FROM nights WHERE night = ?");
  select.bind(1, id);
  if (!select.executeStep()) throw core::DataError(fmt::format("history: no night {}", id));
  night.id = id;
  night.started = select.getColumn(0).getString();
  night.commit = select.getColumn(1).getString();
  night.version = select.getColumn(2).getString();
  night.suite_hash = select.getColumn(3).getString();
  night.quick = select.getColumn(4).getInt() != 0;
  night.fresh_seed = std::stoull(select.getColumn(5).getString());
  night.red = select.getColumn(6).getInt() != 0;
  if (!select.getColumn(7).isNull()) night.baseline = select.getColumn(7).getInt64();
  SQLite::Statement cells(*database_,
                          "SELECT cell, experiment, axes, config_hash, pairing_hash, config FROM cells WHERE night = ? "
                          "ORDER BY cell");
  cells.bind(1, id);
  while (cells.executeStep()) {
    NightCell cell{.experiment = cells.getColumn(1).getString(),
                   .axes = ordered_json::parse(cells.getColumn(2).getString()),
                   .config_hash = cells.getColumn(3).getString(),
                   .pairing_hash = cells.getColumn(4).getString(),
                   .config = ordered_json::parse(cells.getColumn(5).getString()),
                   .fixed = {},
                   .fresh = {},
                   .estimate_s = {}};
    read_runs(*database_, cells.getColumn(0).getInt64(), cell);
    night.cells.push_back(std::move(cell));
  }
  return night;
}

std::vector<TrendPoint> History::trends(bool quick, int nights) const {
  SQLite::Statement select(*database_, R"(
SELECT n.night, n.started, n.commit_id, n.red, c.experiment, c.axes, m.name, avg(m.value * m.value), count(*)
FROM (SELECT * FROM nights WHERE quick = ? ORDER BY night DESC LIMIT ?) n
JOIN cells c USING(night) JOIN runs r USING(cell) JOIN metrics m USING(run)
WHERE r.ok AND NOT r.fresh GROUP BY c.cell, m.name ORDER BY n.night, c.cell, m.name)");
  SQLite::bind(select, quick ? 1 : 0, nights);
  std::vector<TrendPoint> points;
  while (select.executeStep()) {
    points.push_back({.night = select.getColumn(0).getInt64(),
                      .started = select.getColumn(1).getString(),
                      .commit = select.getColumn(2).getString(),
                      .red = select.getColumn(3).getInt() != 0,
                      .experiment = select.getColumn(4).getString(),
                      .axes = select.getColumn(5).getString(),
                      .metric = select.getColumn(6).getString(),
                      .rmse = std::sqrt(select.getColumn(7).getDouble()),
                      .n = select.getColumn(8).getInt()});
  }
  return points;
}

}  // namespace plumbline::tools
