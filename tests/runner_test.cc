#include "eval/runner.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <memory>
#include <new>
#include <numeric>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "core/error.h"
#include "eval/progress.h"
#include "eval/result_store.h"

namespace plumbline::eval {
namespace {

namespace fs = std::filesystem;

fs::path scratch(const std::string& name) {
  const fs::path folder =
      fs::path(testing::TempDir()) / "plumbline_runner" / testing::UnitTest::GetInstance()->current_test_info()->name();
  fs::create_directories(folder);
  fs::remove_all(folder / name);  // of an earlier run
  return folder / name;
}

std::string contents(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

Row make_row(int index) {
  Row row;
  row.run_id = "id" + std::to_string(index);
  row.cell = index / 10;
  row.trial = index % 10;
  row.seed = std::numeric_limits<std::uint64_t>::max() - static_cast<std::uint64_t>(index);
  row.ok = true;
  row.status = "converged";
  row.metrics = {{"ate_position_m", 0.1 / (1 + index)}, {"td_error_s", -1.0 / 3.0, 1.1, 1}};
  row.solver = {.iterations = 7, .final_cost = 1e-300, .cost_per_dof = 1.0, .observations = 100, .landmarks = 9};
  return row;
}

// Trials that take the longer the earlier they are, so that they end out of order.
Row slow_row(int index) {
  std::this_thread::sleep_for(std::chrono::microseconds(200 * (index % 7)));
  return make_row(index);
}

TrialHandlers<Row> into(ResultWriter& writer) {
  return {.sink = [&writer](int index, const Row& row) { writer.add(index, row); },
          .failed_row =
              [](int index, const std::exception& error) {
                Row row = make_row(index);
                row.ok = false;
                row.status = "exception";
                row.reason = error.what();
                row.metrics.clear();
                return row;
              },
          .incident = [](int) { FAIL(); }};
}

TEST(Runner, TheNumberOfThreadsChangesNothing) {
  std::string expected;
  for (const int jobs : {1, 2, 8}) {
    const fs::path path = scratch("results.jsonl");
    ResultWriter writer(path);
    const auto trial = [](int index) -> Row {
      if (index % 10 == 3) throw std::runtime_error("trial " + std::to_string(index) + " broke");
      if (index == 14) throw 42;
      return slow_row(index);
    };
    EXPECT_EQ(run_trials<Row>(60, jobs, trial, into(writer)), 60);
    writer.finish();
    if (expected.empty()) expected = contents(path);
    EXPECT_EQ(contents(path), expected) << jobs << " threads";
    EXPECT_FALSE(fs::exists(path.string() + ".tmp"));
  }
  EXPECT_EQ(std::count(expected.begin(), expected.end(), '\n'), 60);
  EXPECT_NE(expected.find("trial 13 broke"), std::string::npos);
  EXPECT_NE(expected.find("an exception of unknown type"), std::string::npos);
}

// The trials wait for company rather than for a time, since a loaded machine starts threads late.
TEST(Runner, UsesAsManyThreadsAsAsked) {
  std::atomic<int> running = 0;
  std::atomic<int> most = 0;
  int awaited = 1;
  const auto trial = [&](int) {
    const int now = ++running;
    for (int seen = most; seen < now && !most.compare_exchange_weak(seen, now);) {
    }
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(30);
    while (most < awaited && std::chrono::steady_clock::now() < deadline) {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    --running;
    return 0;
  };
  const TrialHandlers<int> handlers{.sink = [](int, int) {}, .failed_row = {}, .incident = {}};
  run_trials<int>(20, 1, trial, handlers);
  EXPECT_EQ(most, 1);
  awaited = 4;
  run_trials<int>(60, 4, trial, handlers);
  EXPECT_EQ(most, 4);
}

TEST(Runner, RunningOutOfMemoryIsAnIncidentNotARow) {
  std::vector<int> rows;
  std::vector<int> incidents;
  const TrialHandlers<int> handlers{.sink = [&](int index, int) { rows.push_back(index); },
                                    .failed_row = [](int, const std::exception&) { return -1; },
                                    .incident = [&](int index) { incidents.push_back(index); }};
  const auto trial = [](int index) -> int {
    if (index == 2) throw std::bad_alloc();
    return index;
  };
  EXPECT_EQ(run_trials<int>(5, 2, trial, handlers), 5);
  EXPECT_EQ(rows, std::vector<int>({0, 1, 3, 4}));
  EXPECT_EQ(incidents, std::vector<int>({2}));
}

TEST(Runner, CancelledRunsLeaveNoHoles) {
  std::atomic<bool> cancel = false;
  std::vector<int> rows;
  const TrialHandlers<int> handlers{.sink =
                                        [&](int index, int) {
                                          rows.push_back(index);
                                          if (index == 20) cancel = true;
                                        },
                                    .failed_row = {},
                                    .incident = {}};
  const auto trial = [](int index) {
    std::this_thread::sleep_for(std::chrono::microseconds(100));
    return index;
  };
  const int delivered = run_trials<int>(100'000, 4, trial, handlers, &cancel);
  EXPECT_GE(delivered, 21);
  EXPECT_LT(delivered, 1000);
  std::vector<int> expected(rows.size());
  std::iota(expected.begin(), expected.end(), 0);
  EXPECT_EQ(rows, expected);
  EXPECT_EQ(std::ssize(rows), delivered);
}

TEST(Runner, AnErrorOfTheSinkReachesTheCaller) {
  const TrialHandlers<int> handlers{.sink =
                                        [](int index, int) {
                                          if (index == 3) throw std::runtime_error("disk full");
                                        },
                                    .failed_row = [](int, const std::exception&) { return 0; },
                                    .incident = {}};
  EXPECT_THROW(run_trials<int>(100, 4, [](int index) { return index; }, handlers), std::runtime_error);
  const auto broken = [](int) -> std::function<void()> { throw std::runtime_error("work"); };
  EXPECT_THROW(run_in_order(100, 4, broken), std::runtime_error);
  EXPECT_THROW(run_in_order(-1, 1, {}), std::invalid_argument);
  EXPECT_THROW(run_in_order(1, 0, {}), std::invalid_argument);
  EXPECT_EQ(run_in_order(0, 1, {}), 0);
}

TEST(ResultStore, ALineIsWhatIsDocumented) {
  EXPECT_EQ(to_line(make_row(12)),
            R"({"run_id":"id12","cell":1,"trial":2,"seed":18446744073709551603,"ok":true,"status":"converged",)"
            R"("reason":"","metrics":{"ate_position_m":{"value":0.007692307692307693},)"
            R"("td_error_s":{"value":-0.3333333333333333,"nees":1.1,"nees_dof":1}},"solver":{"iterations":7,)"
            R"("final_cost":1e-300,"cost_per_dof":1.0,"observations":100,"landmarks":9}})");
}

TEST(ResultStore, LinesReadBackTheSame) {
  Row failed = make_row(3);
  failed.ok = false;
  failed.reason = "a \"quoted\"\nreason \xff";
  failed.metrics.clear();
  failed.solver.final_cost = std::numeric_limits<double>::quiet_NaN();
  for (const Row& row : {make_row(0), make_row(7), failed}) {
    const std::string line = to_line(row);
    EXPECT_EQ(line.find('\n'), std::string::npos);
    EXPECT_EQ(to_line(parse_row(line, "f:1")), line);
  }
  const Row row = parse_row(to_line(make_row(7)), "f:1");
  EXPECT_EQ(row.seed, make_row(7).seed);
  EXPECT_EQ(row.metrics[1].nees, make_row(7).metrics[1].nees);
  EXPECT_EQ(row.metrics[0].value, make_row(7).metrics[0].value);
}

TEST(ResultStore, AnOkRowIsFinite) {
  Row row = make_row(0);
  row.metrics[0].value = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(to_line(row), std::logic_error);
  row = make_row(0);
  row.metrics[1].nees = std::numeric_limits<double>::infinity();
  EXPECT_THROW(to_line(row), std::logic_error);
}

TEST(ResultStore, RefusesWhatItDidNotWrite) {
  const auto refusal = [](std::string line, const std::string& from, const std::string& to) -> std::string {
    line.replace(line.find(from), from.size(), to);
    try {
      parse_row(line, "f:9");
    } catch (const core::DataError& error) {
      return error.what();
    }
    return "accepted";
  };
  const std::string line = to_line(make_row(1));
  EXPECT_EQ(refusal(line, "{\"run_id\"", "\"run_id\""), "f:9: not JSON");
  EXPECT_EQ(refusal(line, "\"cell\"", "\"cel\""), "f:9: cell: missing");
  EXPECT_EQ(refusal(line, "\"ok\":true", "\"ok\":true,\"note\":1"), "f:9: note: unknown key");
  EXPECT_EQ(refusal(line, "\"ok\":true", "\"ok\":1"), "f:9: ok: wrong type or out of range");
  EXPECT_EQ(refusal(line, "\"trial\":1", "\"trial\":-1"), "f:9: trial: wrong type or out of range");
  EXPECT_EQ(refusal(line, "\"trial\":1", "\"trial\":3000000000"), "f:9: trial: wrong type or out of range");
  EXPECT_EQ(refusal(line, "\"value\":0.05", "\"value\":null"),
            "f:9: metrics.ate_position_m: value: wrong type or out of range");
  EXPECT_EQ(refusal(line, ",\"nees_dof\":1", ""), "f:9: metrics.td_error_s: nees_dof: missing");
  EXPECT_EQ(refusal(line, "\"final_cost\":1e-300", "\"final_cost\":null"),
            "f:9: solver: final_cost: wrong type or out of range");
}

TEST(ResultStore, TheFileIsAPrefixUntilItIsWhole) {
  const fs::path path = scratch("results.jsonl");
  const std::string partial = path.string() + ".tmp";
  ResultWriter writer(path);
  writer.add(2, make_row(2));
  writer.add(1, make_row(1));
  EXPECT_EQ(contents(partial), "");
  EXPECT_THROW(writer.finish(), std::logic_error);
  writer.add(0, make_row(0));
  EXPECT_EQ(contents(partial), to_line(make_row(0)) + "\n" + to_line(make_row(1)) + "\n" + to_line(make_row(2)) + "\n");
  EXPECT_THROW(writer.add(1, make_row(1)), std::logic_error);
  EXPECT_FALSE(fs::exists(path));
  writer.finish();
  EXPECT_FALSE(fs::exists(partial));
  int count = 0;
  for_each_row(path, Tail::kWhole, [&](const Row& row) { EXPECT_EQ(row.run_id, make_row(count++).run_id); });
  EXPECT_EQ(count, 3);
}

TEST(ResultStore, ATornLastLineIsLeftOutOnlyWhereAsked) {
  const fs::path path = scratch("results.jsonl.tmp");
  const std::string two = to_line(make_row(0)) + "\n" + to_line(make_row(1)) + "\n";
  std::ofstream(path, std::ios::binary) << two << to_line(make_row(2)).substr(0, 40);
  int count = 0;
  for_each_row(path, Tail::kMayTear, [&](const Row&) { ++count; });
  EXPECT_EQ(count, 2);
  EXPECT_THROW(for_each_row(path, Tail::kWhole, [](const Row&) {}), core::DataError);
  EXPECT_THROW(for_each_row(scratch("missing"), Tail::kMayTear, [](const Row&) {}), core::DataError);
}

TEST(Progress, TellsWhatIsLeft) {
  EXPECT_EQ(progress_line(50, 100, 1, 65.0), "[###############...............]  50/100  1 failed  eta 0:01:05");
  EXPECT_EQ(progress_line(0, 100, 0, 3.0), "[..............................]  0/100");
  EXPECT_EQ(progress_line(100, 100, 0, 3.0), "[##############################]  100/100");
}

TEST(Progress, IsSilentWithoutATerminal) {
  const fs::path path = scratch("log");
  const auto close = [](std::FILE* stream) { std::fclose(stream); };
  std::unique_ptr<std::FILE, decltype(close)> file(std::fopen(path.c_str(), "w"), close);
  ASSERT_NE(file, nullptr);
  {
    Progress progress(file.get(), 10);
    for (int k = 0; k < 10; ++k) progress.add(true);
  }
  file.reset();
  EXPECT_EQ(contents(path), "");
}

}  // namespace
}  // namespace plumbline::eval
