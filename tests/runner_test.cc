#include "eval/runner.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <limits>
#include <map>
#include <memory>
#include <new>
#include <numeric>
#include <set>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

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

using Launcher = void (*)(const std::vector<int>&, const TrialRun&);

std::vector<int> first(int count) {
  std::vector<int> indices(static_cast<std::size_t>(count));
  std::iota(indices.begin(), indices.end(), 0);
  return indices;
}

// By index.
std::map<int, TrialEnd> launch(Launcher launcher, int count, int jobs, std::function<std::string(int)> trial,
                               double cpu_limit_s = 0.0) {
  std::map<int, TrialEnd> ends;
  const auto sink = [&](const TrialEnd& end) { EXPECT_TRUE(ends.emplace(end.index, end).second) << end.index; };
  launcher(first(count), {.trial = std::move(trial), .sink = sink, .jobs = jobs, .cpu_limit_s = cpu_limit_s});
  return ends;
}

class Launchers : public testing::TestWithParam<Launcher> {};
INSTANTIATE_TEST_SUITE_P(Runner, Launchers, testing::Values(run_in_threads, run_in_processes),
                         [](const auto& launcher) { return launcher.index == 0 ? "threads" : "processes"; });

TEST_P(Launchers, EachTrialEndsOnceHoweverManyRun) {
  const auto trial = [](int index) -> std::string {
    if (index % 10 == 3) throw std::runtime_error("trial " + std::to_string(index) + " broke");
    if (index == 14) throw 42;
    if (index == 25) throw std::bad_alloc();
    return std::string(static_cast<std::size_t>(index) * 5'000, static_cast<char>('a' + index % 26));
  };
  for (const int jobs : {1, 2, 8}) {
    const auto ends = launch(GetParam(), 60, jobs, trial);
    ASSERT_EQ(ends.size(), 60U);
    for (const auto& [index, end] : ends) {
      if (index % 10 == 3) {
        EXPECT_EQ(end.outcome, Outcome::kException);
        EXPECT_EQ(end.text, "trial " + std::to_string(index) + " broke");
      } else if (index == 14) {
        EXPECT_EQ(end.text, "an exception of unknown type");
      } else if (index == 25) {
        EXPECT_EQ(end.outcome, Outcome::kOutOfMemory);
      } else {
        EXPECT_EQ(end.outcome, Outcome::kAnswer);
        EXPECT_EQ(end.text, trial(index));  // also of more bytes than a socket holds
      }
    }
  }
  EXPECT_TRUE(launch(GetParam(), 0, 1, trial).empty());
  EXPECT_THROW(launch(GetParam(), 1, 0, trial), std::invalid_argument);
}

TEST_P(Launchers, CancelledRunsFinishWhatIsUnderWay) {
  std::atomic<bool> cancel = false;
  std::vector<int> ended;
  const auto sink = [&](const TrialEnd& end) {
    EXPECT_EQ(end.outcome, Outcome::kAnswer);
    ended.push_back(end.index);
    if (end.index == 20) cancel = true;
  };
  const auto trial = [](int index) {
    std::this_thread::sleep_for(std::chrono::microseconds(100));
    return std::to_string(index);
  };
  GetParam()(first(100'000), {.trial = trial, .sink = sink, .jobs = 4, .cancel = &cancel});
  EXPECT_GE(ended.size(), 21U);
  EXPECT_LT(ended.size(), 1000U);
  std::sort(ended.begin(), ended.end());
  EXPECT_EQ(ended, first(static_cast<int>(ended.size())));  // none that was begun is missing
}

TEST_P(Launchers, AnErrorOfTheSinkReachesTheCaller) {
  const auto sink = [](const TrialEnd& end) {
    if (end.index == 3) throw std::runtime_error("disk full");
  };
  const auto trial = [](int index) { return std::to_string(index); };
  EXPECT_THROW(GetParam()(first(100), {.trial = trial, .sink = sink, .jobs = 4}), std::runtime_error);
}

// The trials wait for company rather than for a time, since a loaded machine starts threads late.
TEST(Runner, UsesAsManyThreadsAsAsked) {
  std::atomic<int> running = 0;
  std::atomic<int> most = 0;
  int awaited = 1;
  const auto trial = [&](int) -> std::string {
    const int now = ++running;
    for (int seen = most; seen < now && !most.compare_exchange_weak(seen, now);) {
    }
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(30);
    while (most < awaited && std::chrono::steady_clock::now() < deadline) {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    --running;
    return "";
  };
  launch(run_in_threads, 20, 1, trial);
  EXPECT_EQ(most, 1);
  awaited = 4;
  launch(run_in_threads, 60, 4, trial);
  EXPECT_EQ(most, 4);
}

TEST(Runner, UsesAsManyProcessesAsAsked) {
  const auto trial = [](int) {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
    return std::to_string(::getpid());
  };
  std::set<std::string> workers;
  for (const auto& [index, end] : launch(run_in_processes, 60, 4, trial)) workers.insert(end.text);
  EXPECT_EQ(workers.size(), 4U);
  EXPECT_FALSE(workers.contains(std::to_string(::getpid())));
}

// By its default action, also where a sanitizer handles it.
[[noreturn]] void die_of(int signal) {
  std::signal(signal, SIG_DFL);
  std::raise(signal);
  std::abort();
}

TEST(Runner, AWorkerThatDiesIsReplacedAndTellsWhy) {
  const auto trial = [](int index) -> std::string {
    switch (index) {
      case 2:
        die_of(SIGSEGV);
      case 5:
        std::abort();
      case 7:
        std::_Exit(9);
      case 11:
        die_of(SIGKILL);
      case 13:
        for (std::atomic<int> spin = 0;; ++spin) {
        }
      default:
        return std::to_string(index);
    }
  };
  const auto ends = launch(run_in_processes, 20, 3, trial, 0.2);
  ASSERT_EQ(ends.size(), 20U);
  const auto expect = [&](int index, Outcome outcome, const char* text) {
    EXPECT_EQ(ends.at(index).outcome, outcome) << index;
    EXPECT_EQ(ends.at(index).text, text);
  };
  expect(2, Outcome::kCrash, "killed by SIGSEGV");
  expect(5, Outcome::kCrash, "killed by SIGABRT");
  expect(7, Outcome::kCrash, "left with exit code 9");
  expect(11, Outcome::kKilled, "killed by SIGKILL");
  expect(13, Outcome::kCpuLimit, "cpu limit");
  for (const int index : {0, 1, 3, 4, 6, 8, 9, 10, 12, 14, 19}) {
    expect(index, Outcome::kAnswer, std::to_string(index).c_str());
  }
}

// The limit is one trial's, not that of all that a worker has run.
TEST(Runner, TheCpuLimitBeginsAnewWithEachTrial) {
  const auto trial = [](int) -> std::string {
    const std::clock_t end = std::clock() + CLOCKS_PER_SEC / 10;
    while (std::clock() < end) {
    }
    return "";
  };
  for (const auto& [index, end] : launch(run_in_processes, 6, 1, trial, 0.3)) {
    EXPECT_EQ(end.outcome, Outcome::kAnswer) << index;
  }
}

bool is_running(::pid_t pid) {
  std::ifstream stat("/proc/" + std::to_string(pid) + "/stat");
  std::string number;
  std::string name;
  std::string state;
  return stat >> number >> name >> state && state != "Z" && state != "X";
}

TEST(Runner, WorkersDieWithTheirParent) {
  std::array<int, 2> pipe{};
  ASSERT_EQ(::pipe(pipe.data()), 0);
  const ::pid_t parent = ::fork();
  if (parent == 0) {
    const auto trial = [&](int) -> std::string {
      const ::pid_t me = ::getpid();
      if (::write(pipe[1], &me, sizeof me) != sizeof me) std::abort();
      for (;;) ::pause();
    };
    run_in_processes(first(2), {.trial = trial, .sink = [](const TrialEnd&) {}, .jobs = 2});
    std::_Exit(0);
  }
  std::array<::pid_t, 2> workers{};
  for (::pid_t& worker : workers) ASSERT_EQ(::read(pipe[0], &worker, sizeof worker), ssize_t{sizeof worker});
  ::kill(parent, SIGKILL);
  ASSERT_EQ(::waitpid(parent, nullptr, 0), parent);
  for (const ::pid_t worker : workers) {
    for (int i = 0; i < 1000 && is_running(worker); ++i) std::this_thread::sleep_for(std::chrono::milliseconds(10));
    EXPECT_FALSE(is_running(worker));
  }
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

TEST(ResultStore, ATornLastLineIsRefused) {
  const fs::path path = scratch("results.jsonl.tmp");
  const std::string two = to_line(make_row(0)) + "\n" + to_line(make_row(1)) + "\n";
  std::ofstream(path, std::ios::binary) << two << to_line(make_row(2)).substr(0, 40);
  int count = 0;
  EXPECT_THROW(for_each_row(path, [&](const Row&) { ++count; }), core::DataError);
  EXPECT_EQ(count, 2);
  EXPECT_THROW(for_each_row(scratch("missing"), [](const Row&) {}), core::DataError);
}

TEST(Progress, TellsWhatIsLeft) {
  EXPECT_EQ(progress_line({.total = 100, .done = 50, .failed = 1, .worst = "0.2 m"}, 65.0),
            "[###############...............]  50/100  49 ok  1 failed  eta 0:01:05  worst 0.2 m");
  // Half of what this program had to do is done.
  EXPECT_EQ(progress_line({.total = 100, .before = 50, .done = 75, .incidents = 2, .worst = {}}, 65.0),
            "[######################........]  75/100  73 ok  2 incidents  eta 0:01:05");
  EXPECT_EQ(progress_line({.total = 100, .worst = {}}, 3.0), "[..............................]  0/100");
  EXPECT_EQ(progress_line({.total = 100, .done = 100, .worst = {}}, 3.0),
            "[##############################]  100/100  100 ok");
}

TEST(Progress, WritesALineNowAndThenWithoutATerminal) {
  const auto lines = [](std::chrono::seconds period) {
    const fs::path path = scratch("log");
    const auto close = [](std::FILE* stream) { std::fclose(stream); };
    std::unique_ptr<std::FILE, decltype(close)> file(std::fopen(path.c_str(), "w"), close);
    {
      Progress progress(file.get(), period);
      for (int k = 1; k <= 10; ++k) progress.show({.total = 10, .done = k, .worst = {}});
    }
    file.reset();
    const std::string text = contents(path);
    return std::count(text.begin(), text.end(), '\n');
  };
  EXPECT_EQ(lines(std::chrono::seconds(30)), 0);
  EXPECT_EQ(lines(std::chrono::seconds(0)), 10);
}

}  // namespace
}  // namespace plumbline::eval
