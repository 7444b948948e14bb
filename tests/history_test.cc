// The history keeps whole nights to the last bit, whoever is killed, whoever writes beside it, however old the file.
#include "tools/history.h"

#include <csignal>
#include <filesystem>
#include <string>

#include <SQLiteCpp/SQLiteCpp.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include "core/error.h"
#include "program_test.h"

namespace plumbline::tools {
namespace {

using ::testing::HasSubstr;

Night night_of(int number, int trials = 30) {
  Night night;
  night.started = "2026-11-26 20:45:00";
  night.commit = "abc" + std::to_string(number);
  night.version = "0.1.0";
  night.suite_hash = "0123";
  night.fresh_seed = 18446744073709551615U;
  night.provenance = {{"Compiler", "12.2"}};
  NightCell cell{.experiment = "batch",
                 .axes = {{"scenario.camera.td_s", 0.02}},
                 .config_hash = "c",
                 .pairing_hash = "p",
                 .config = {{"x", 1}},
                 .fixed = {},
                 .fresh = {},
                 .estimate_s = {}};
  for (int t = 0; t < trials; ++t) {
    eval::Row row;
    row.run_id = "r" + std::to_string(t);
    row.trial = t;
    row.seed = 18446744073709551615U;
    row.ok = t != 3;
    row.status = row.ok ? "converged" : "diverged";
    if (row.ok) {
      row.metrics = {{.name = "ate_position_m", .value = 1.0 / (3.0 + t), .crlb = 0.1},
                     {.name = "td_error_s", .value = -1e-5 / (7.0 + t), .nees = 1e-300, .nees_dof = 1}};
    }
    cell.fixed.push_back(row);
    cell.estimate_s.push_back(0.1 * t);
  }
  cell.fresh = {cell.fixed[0]};
  night.cells.push_back(std::move(cell));
  return night;
}

class HistoryTest : public ProgramTest {
 protected:
  std::filesystem::path file() const { return folder_ / "history.sqlite"; }
  int count(const std::string& table) const {
    return SQLite::Database(file().string()).execAndGet("SELECT count(*) FROM " + table).getInt();
  }
};

TEST_F(HistoryTest, GivesBackWhatItTook) {
  History history(file());
  const Night before = night_of(1);
  const std::int64_t id = history.add(before);
  const Night after = history.load(id);
  EXPECT_EQ(after.commit, before.commit);
  EXPECT_EQ(after.fresh_seed, before.fresh_seed);
  ASSERT_EQ(after.cells.size(), 1U);
  const NightCell& cell = after.cells[0];
  EXPECT_EQ(cell.axes, before.cells[0].axes);
  EXPECT_EQ(cell.estimate_s, before.cells[0].estimate_s);
  ASSERT_EQ(cell.fixed.size(), 30U);
  EXPECT_EQ(cell.fresh.size(), 1U);
  for (std::size_t i = 0; i < cell.fixed.size(); ++i) {
    const eval::Row& x = before.cells[0].fixed[i];
    const eval::Row& y = cell.fixed[i];
    EXPECT_EQ(y.ok, x.ok);
    EXPECT_EQ(y.seed, x.seed);
    ASSERT_EQ(y.metrics.size(), x.metrics.size());
    for (std::size_t k = 0; k < x.metrics.size(); ++k) {
      EXPECT_EQ(y.metrics[k].value, x.metrics[k].value);  // to the last bit
      EXPECT_EQ(y.metrics[k].nees, x.metrics[k].nees);
    }
  }
  const auto trends = history.trends(false, 10);
  ASSERT_EQ(trends.size(), 2U);
  EXPECT_EQ(trends[0].n, 29);
}

TEST_F(HistoryTest, FindsABaseline) {
  History history(file());
  EXPECT_FALSE(history.find("last_green", false));
  const auto add = [&](int number, bool red, bool quick, const std::string& tag) {
    Night night = night_of(number, 2);
    night.red = red;
    night.quick = quick;
    night.tag = tag;
    return history.add(night);
  };
  const auto first = add(1, false, false, "v1");
  const auto second = add(2, false, false, "");
  const auto red = add(3, true, false, "");
  const auto quick = add(4, false, true, "");
  EXPECT_EQ(history.find("last_green", false), second);
  EXPECT_EQ(history.find("last_green", true), quick);
  EXPECT_EQ(history.find("v1", false), first);
  EXPECT_EQ(history.find("abc3", false), red);
  EXPECT_FALSE(history.find("v1", true));
  EXPECT_FALSE(history.find("v2", false));
  add(5, false, false, "v1");
  EXPECT_NE(history.find("v1", false), first);  // the tag has moved
}

// Twenty times a writer is killed at some instant while it adds one night after another.
TEST_F(HistoryTest, SurvivesKills) {
  {
    const History history(file());
  }
  for (int kill_number = 0; kill_number < 20; ++kill_number) {
    const pid_t writer = ::fork();
    ASSERT_GE(writer, 0);
    if (writer == 0) {
      History history(file());
      for (int i = 0;; ++i) history.add(night_of(i));
    }
    ::usleep(static_cast<useconds_t>(20'000 + 3'700 * kill_number));
    ::kill(writer, SIGKILL);
    ::waitpid(writer, nullptr, 0);
    SQLite::Database database(file().string());
    EXPECT_EQ(database.execAndGet("PRAGMA integrity_check").getString(), "ok");
    EXPECT_EQ(count("runs"), 31 * count("nights"));
    EXPECT_EQ(count("metrics"), 60 * count("nights"));
  }
  EXPECT_GT(count("nights"), 0);
  History history(file());
  const int before = count("nights");
  history.add(night_of(0));
  EXPECT_EQ(count("nights"), before + 1);
}

TEST_F(HistoryTest, TwoWritersLoseNothing) {
  constexpr int kNights = 15;
  std::vector<pid_t> writers;
  for (int w = 0; w < 2; ++w) {
    writers.push_back(::fork());
    ASSERT_GE(writers.back(), 0);
    if (writers.back() != 0) continue;
    try {
      History history(file());  // both may make the file
      for (int i = 0; i < kNights; ++i) history.add(night_of(i));
    } catch (const std::exception&) {
      ::_exit(1);
    }
    ::_exit(0);
  }
  for (const pid_t writer : writers) {
    int status = -1;
    ::waitpid(writer, &status, 0);
    EXPECT_EQ(status, 0);
  }
  EXPECT_EQ(count("nights"), 2 * kNights);
  EXPECT_EQ(count("runs"), 2 * kNights * 31);
}

TEST_F(HistoryTest, BringsAnOldFileUpToDate) {
  std::int64_t id = 0;
  {
    History history(file());
    id = history.add(night_of(1));
  }
  {  // as version 1 left it
    SQLite::Database database(file().string(), SQLite::OPEN_READWRITE);
    database.exec("DROP TABLE gates; DROP TABLE tags; PRAGMA user_version = 1;");
  }
  History history(file());
  EXPECT_EQ(history.load(id).cells[0].fixed.size(), 30U);
  Night night = night_of(2);
  night.tag = "v1";
  const auto tagged = history.add(night);
  EXPECT_EQ(history.find("v1", false), tagged);
  EXPECT_EQ(SQLite::Database(file().string()).execAndGet("PRAGMA user_version").getInt(), kHistoryVersion);
}

TEST_F(HistoryTest, RefusesWhatItDoesNotKnow) {
  const auto refusal = [&] {
    try {
      const History history(file());
    } catch (const core::DataError& error) {
      return std::string(error.what());
    }
    return std::string("none");
  };
  write("history.sqlite",
        "this is text, long enough to be looked at as a header of a database file, and no such thing");
  EXPECT_THAT(refusal(), HasSubstr("history.sqlite: "));
  std::filesystem::remove(file());
  SQLite::Database(file().string(), SQLite::OPEN_READWRITE | SQLite::OPEN_CREATE).exec("CREATE TABLE other(x)");
  EXPECT_THAT(refusal(), HasSubstr("something else"));
  SQLite::Database(file().string(), SQLite::OPEN_READWRITE).exec("PRAGMA user_version = 99");
  EXPECT_THAT(refusal(), HasSubstr("newer"));
}

}  // namespace
}  // namespace plumbline::tools
