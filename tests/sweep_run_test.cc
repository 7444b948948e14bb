// Sweeps that are disturbed: every run ends as a row or an incident that names its cause, and what comes out in the end
// is what an undisturbed sweep gives, byte by byte. The trials that break are the tests' own.
#include <algorithm>
#include <array>
#include <atomic>
#include <csignal>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <new>
#include <stdexcept>
#include <string>
#include <vector>

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <sys/mount.h>
#include <sys/wait.h>
#include <unistd.h>

#include "core/error.h"
#include "program_test.h"
#include "tools/folder_lock.h"
#include "tools/sweep.h"

namespace plumbline::tools {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

// By its default action, also where a sanitizer handles it.
[[noreturn]] void die_of(int signal) {
  std::signal(signal, SIG_DFL);
  std::raise(signal);
  std::abort();
}

// run_trial, but trial `k` does something else before.
template <class What>
TrialFunction disturbed(std::uint64_t k, What what) {
  return [=](const Experiment& experiment, core::TrialId id, TrialTimings* timings) {
    if (id.trial == k) what();
    return run_trial(experiment, id, timings);
  };
}

class Sweep : public ProgramTest {
 protected:
  void SetUp() override {
    ProgramTest::SetUp();
    // Two cells of six trials, each some milliseconds.
    write("small.yaml", R"(experiment: {trials: 6, seed: 5, axes: {scenario.camera.td_s: [0, 0.02]}}
scenario:
  duration_s: 1
  imu: {gyro_noise_density_rad_s_sqrt_hz: 1.7e-4, gyro_bias_walk_rad_s2_sqrt_hz: 2.0e-5,
        accel_noise_density_m_s2_sqrt_hz: 2.0e-3, accel_bias_walk_m_s3_sqrt_hz: 3.0e-3}
  camera: {readout_s: 0.03}
  world: {landmarks: 200}
  points: {per_frame: 10}
estimator: {keyframe_rate_hz: 5}
)");
  }

  RunOptions options(const std::string& out) const {
    RunOptions options;
    options.experiment = folder_ / "small.yaml";
    options.out = folder_ / out;
    options.jobs = 2;
    options.set = {"experiment.max_failed_share=1"};
    return options;
  }

  // As the program would, with a trial of ours.
  ProgramResult run_with(const RunOptions& options, const TrialFunction& trial = run_trial) const {
    ProgramResult result;
    ::testing::internal::CaptureStdout();
    ::testing::internal::CaptureStderr();
    std::string error;
    try {
      result.code = run(options, trial);
    } catch (const core::InputError& input) {
      result.code = kExitBadInput;
      error = input.what();
    } catch (const std::exception& internal) {
      result.code = kExitInternal;
      error = internal.what();
    }
    result.out = ::testing::internal::GetCapturedStdout();
    result.err = ::testing::internal::GetCapturedStderr() + error;
    return result;
  }

  // A program of its own, that a trial can kill: kill(getppid(), SIGKILL) in a worker.
  int run_apart(const RunOptions& options, const TrialFunction& trial) const {
    const ::pid_t child = ::fork();
    if (child == 0) {
      const int null = ::open("/dev/null", O_WRONLY);
      ::dup2(null, STDOUT_FILENO);
      ::dup2(null, STDERR_FILENO);
      std::_Exit(run(options, trial));
    }
    int status = 0;
    ::waitpid(child, &status, 0);
    return status;
  }

  // results.jsonl and all series.
  std::string bytes(const std::string& out) const {
    std::string all = read(folder_ / out / "results.jsonl");
    for (const std::string& name : listing(folder_ / out / "series")) {
      all += name + "\n" + read(folder_ / out / "series" / name);
    }
    return all;
  }

  nlohmann::json status(const std::string& out) const {
    return nlohmann::json::parse(plumbline("status " + out + " --json").out);
  }

  std::vector<nlohmann::json> lines(const fs::path& file) const {
    std::vector<nlohmann::json> values;
    std::ifstream stream(folder_ / file);
    for (std::string line; std::getline(stream, line);) values.push_back(nlohmann::json::parse(line));
    return values;
  }
};

TEST_F(Sweep, TheLauncherDoesNotShowInTheBytes) {
  RunOptions threads = options("threads");
  threads.launcher = Launcher::kThreads;
  ASSERT_EQ(run_with(threads).code, 0);
  ASSERT_EQ(run_with(options("processes")).code, 0);
  EXPECT_EQ(bytes("threads"), bytes("processes"));
  EXPECT_EQ(listing(folder_ / "threads"), listing(folder_ / "processes"));
  EXPECT_THAT(lines("threads/timings.jsonl"), ::testing::SizeIs(12));
}

// The same row at each run; what replay gives, too.
TEST_F(Sweep, ATrialsOwnFaultIsAFailedRow) {
  struct Fault {
    const char* status;
    const char* reason;
    void (*what)();
  };
  const std::array<Fault, 4> faults = {{{"crash", "killed by SIGSEGV", [] { die_of(SIGSEGV); }},
                                        {"crash", "killed by SIGABRT", [] { std::abort(); }},
                                        {"crash", "left with exit code 4", [] { std::_Exit(4); }},
                                        {"exception", "of the test", [] { throw std::runtime_error("of the test"); }}}};
  for (const Fault& fault : faults) {
    const ProgramResult result = run_with(options("out"), disturbed(2, fault.what));
    EXPECT_EQ(result.code, 0) << result.err;
    EXPECT_THAT(result.err, HasSubstr(std::string("cell 1 trial 2 of seed 5: ") + fault.status + ": " + fault.reason +
                                      "; plumbline replay " + (folder_ / "out").string() + " 1 2\n"));
    const auto rows = lines("out/results.jsonl");
    ASSERT_EQ(rows.size(), 12U);
    for (const nlohmann::json& row : rows) {
      const bool broke = row["trial"] == 2;
      EXPECT_EQ(row["ok"], !broke);
      if (!broke) continue;
      EXPECT_EQ(row["seed"], 5);
      EXPECT_EQ(row["status"], fault.status);
      EXPECT_EQ(row["reason"], fault.reason);
    }
    EXPECT_EQ(read(folder_ / "out/incidents.jsonl"), "");
    EXPECT_EQ(status("out")["failed"], 2);

    ::testing::internal::CaptureStdout();
    ::testing::internal::CaptureStderr();
    EXPECT_EQ(replay({.results = folder_ / "out", .run = {"1", "2"}, .dump = {}}, disturbed(2, fault.what)), 0);
    EXPECT_EQ(nlohmann::json::parse(::testing::internal::GetCapturedStdout()), rows[8]);
    EXPECT_THAT(::testing::internal::GetCapturedStderr(), HasSubstr("identical to the stored row"));
    fs::remove_all(folder_ / "out");
  }
}

TEST_F(Sweep, TheMachinesFaultIsAnIncidentAndTriedAgain) {
  ASSERT_EQ(run_with(options("undisturbed")).code, 0);
  struct Fault {
    const char* cause;
    void (*what)();
  };
  const auto hang = [] {
    for (std::atomic<int> spin = 0;; ++spin) {
    }
  };
  const auto eat = [] {
#ifdef PLUMBLINE_SANITIZED
    throw std::bad_alloc();  // their allocators would end the process
#else
    ::operator delete(::operator new(std::size_t{1} << 47));  // all the addresses there are
#endif
  };
  const std::array<Fault, 3> faults = {
      {{"cpu limit", hang}, {"out of memory", eat}, {"killed by SIGKILL", [] { std::raise(SIGKILL); }}}};
  for (const Fault& fault : faults) {
    RunOptions limited = options("out");
    limited.set.emplace_back("experiment.cpu_limit_s=1");
    const ProgramResult result = run_with(limited, disturbed(3, fault.what));
    EXPECT_EQ(result.code, kExitInternal);
    EXPECT_THAT(result.err, HasSubstr(std::string("cell 0 trial 3 of seed 5: ") + fault.cause));
    EXPECT_THAT(result.err, HasSubstr("2 runs were lost to the machine"));
    const auto incidents = lines("out/incidents.jsonl");
    ASSERT_EQ(incidents.size(), 2U);
    EXPECT_EQ(incidents[1]["cell"], 1);
    EXPECT_EQ(incidents[1]["trial"], 3);
    EXPECT_EQ(incidents[1]["seed"], 5);
    EXPECT_EQ(incidents[1]["cause"], fault.cause);
    EXPECT_THAT(incidents[1]["replay"].get<std::string>(), HasSubstr("out 1 3"));
    EXPECT_EQ(lines("out/results.jsonl").size(), 10U);
    EXPECT_EQ(status("out")["incidents"], 2);

    EXPECT_EQ(run_with(limited).code, 0);
    EXPECT_EQ(bytes("out"), bytes("undisturbed"));
    EXPECT_EQ(read(folder_ / "out/incidents.jsonl"), "");
    fs::remove_all(folder_ / "out");
  }
}

TEST_F(Sweep, AFinishedSweepIsLeftAlone) {
  ASSERT_EQ(run_with(options("out")).code, 0);
  const auto times = [&] {
    std::map<std::string, fs::file_time_type> by_name;
    for (const std::string& name : listing(folder_ / "out"))
      by_name[name] = fs::last_write_time(folder_ / "out" / name);
    by_name.erase("shards/lock");
    return by_name;
  };
  const auto before = times();
  const auto never = [](const Experiment&, core::TrialId, TrialTimings*) -> eval::TrialResult { std::abort(); };
  const ProgramResult again = run_with(options("out"), never);
  EXPECT_EQ(again.code, 0);
  EXPECT_THAT(again.err, HasSubstr("nothing to do, all 12 runs are in"));
  EXPECT_THAT(again.out, HasSubstr("6/6 ok"));
  EXPECT_EQ(times(), before);
}

TEST_F(Sweep, MoreTrialsExtendIt) {
  RunOptions more = options("whole");
  ASSERT_EQ(run_with(more).code, 0);
  RunOptions few = options("out");
  few.trials = 4;
  ASSERT_EQ(run_with(few).code, 0);
  more.out = folder_ / "out";
  const auto only_new = [](const Experiment& experiment, core::TrialId id, TrialTimings* timings) {
    if (id.trial < 4) std::abort();
    return run_trial(experiment, id, timings);
  };
  ASSERT_EQ(run_with(more, only_new).code, 0);
  EXPECT_EQ(bytes("out"), bytes("whole"));
  EXPECT_EQ(lines("out/timings.jsonl").size(), 12U);
}

TEST_F(Sweep, KilledWithItsWorkersItGoesOn) {
  ASSERT_EQ(run_with(options("undisturbed")).code, 0);
  // Each time trial by trial a little further.
  for (const std::uint64_t k : {1, 3, 5}) {
    const int status = run_apart(options("out"), disturbed(k, [] {
                                   ::kill(::getppid(), SIGKILL);
                                   ::pause();
                                 }));
    ASSERT_TRUE(WIFSIGNALED(status));
    EXPECT_FALSE(fs::exists(folder_ / "out/results.jsonl"));
  }
  const nlohmann::json before = status("out");
  EXPECT_GE(before["done"], 3);
  EXPECT_GT(before["missing"], 0);
  EXPECT_EQ(before["writer"], nullptr);
  ASSERT_EQ(run_with(options("out")).code, 0);
  EXPECT_EQ(bytes("out"), bytes("undisturbed"));
  EXPECT_EQ(listing(folder_ / "out"), listing(folder_ / "undisturbed"));
}

TEST_F(Sweep, CtrlCFinishesWhatIsUnderWayAndSaysHowToGoOn) {
  ASSERT_EQ(run_with(options("undisturbed")).code, 0);
  const ProgramResult result = run_with(options("out"), disturbed(1, [] { ::kill(::getppid(), SIGINT); }));
  EXPECT_EQ(result.code, kExitInternal);
  EXPECT_THAT(result.err, HasSubstr("of 12 runs done; to go on: plumbline run " + (folder_ / "out").string()));
  const nlohmann::json state = status("out");
  EXPECT_GE(state["done"], 2);
  EXPECT_LT(state["done"], 12);
  EXPECT_EQ(plumbline("run out").code, 0);
  EXPECT_EQ(bytes("out"), bytes("undisturbed"));
  EXPECT_EQ(plumbline("run out --trials 9").code, 2);
}

// A torn tail is what a kill leaves and needs no word; all else that cannot be read is named.
TEST_F(Sweep, TornAndDamagedLinesAreRunAgain) {
  ASSERT_EQ(run_with(options("undisturbed")).code, 0);
  RunOptions shard = options("out");
  shard.shard = Shard{0, 2};
  ASSERT_EQ(run_with(shard).code, 0);
  const fs::path file = folder_ / "out/shards/shard-0.jsonl";
  const std::string whole = read(file);
  const auto line_at = [&](int n) {
    std::size_t at = 0;
    for (int i = 0; i < n; ++i) at = whole.find('\n', at) + 1;
    return at;
  };
  std::string text = whole;
  text.replace(line_at(3) + 5, 20, std::string(20, '\0'));  // the row of the second run
  text.resize(line_at(11) + 30);                            // within that of the sixth, the last
  save(file, text);
  EXPECT_EQ(status("out")["done"], 4);
  const ProgramResult merge = plumbline("merge out");
  EXPECT_EQ(merge.code, kExitInternal);
  EXPECT_THAT(merge.err, HasSubstr("shard-0.jsonl:4: not a JSON object; its run counts as missing"));
  const ProgramResult result = run_with(options("out"));
  EXPECT_EQ(result.code, 0);
  EXPECT_THAT(result.err, HasSubstr("shard-0.jsonl:4: "));
  EXPECT_THAT(result.err, ::testing::Not(HasSubstr("shard-0.jsonl:12")));
  EXPECT_EQ(bytes("out"), bytes("undisturbed"));
}

// As a power cut may leave it: the row is there, its series is not.
TEST_F(Sweep, ARowWithoutItsWholeSeriesIsRunAgain) {
  ASSERT_EQ(run_with(options("undisturbed")).code, 0);
  RunOptions shard = options("out");
  shard.shard = Shard{0, 1};
  ASSERT_EQ(run_with(shard).code, 0);
  const std::vector<std::string> series = listing(folder_ / "out/series");
  save(folder_ / "out/series" / series[0], "");
  fs::remove(folder_ / "out/series" / series[1]);
  EXPECT_EQ(status("out")["missing"], 2);
  EXPECT_THAT(status("out")["damaged"][0].get<std::string>(), HasSubstr(" is not whole"));
  ASSERT_EQ(run_with(options("out")).code, 0);
  EXPECT_EQ(bytes("out"), bytes("undisturbed"));
}

TEST_F(Sweep, ShardsMergeInAnyOrder) {
  ASSERT_EQ(run_with(options("whole")).code, 0);
  std::vector<int> order = {0, 1, 2, 3, 4};
  for (const std::uint32_t rotation : {0U, 2U}) {
    std::rotate(order.begin(), order.begin() + rotation, order.end());
    for (const int i : order) {
      EXPECT_EQ(plumbline("merge out").code, i == order[0] ? kExitBadInput : kExitInternal);
      RunOptions shard = options("out");
      shard.shard = Shard{i, 5};
      ASSERT_EQ(run_with(shard).code, 0);
      EXPECT_FALSE(fs::exists(folder_ / "out/results.jsonl"));
    }
    // A task that ran twice leaves a copy.
    fs::copy(folder_ / "out/shards/shard-1.jsonl", folder_ / "out/shards/journal-1-n1-7-0.jsonl");
    const ProgramResult merge = plumbline("merge out");
    EXPECT_EQ(merge.code, 0) << merge.err;
    EXPECT_EQ(bytes("out"), bytes("whole"));
    EXPECT_EQ(listing(folder_ / "out"), listing(folder_ / "whole"));
    EXPECT_EQ(plumbline("merge out").code, 0);  // once more changes nothing
    EXPECT_EQ(bytes("out"), bytes("whole"));
    fs::remove_all(folder_ / "out");
  }
}

TEST_F(Sweep, MergeSaysWhatIsMissing) {
  for (const int i : {0, 2}) {
    RunOptions shard = options("out");
    shard.shard = Shard{i, 3};
    ASSERT_EQ(run_with(shard).code, 0);
  }
  const ProgramResult merge = plumbline("merge out");
  EXPECT_EQ(merge.code, kExitInternal);
  EXPECT_THAT(merge.err, HasSubstr("nothing is merged while runs are missing: 8/12 done, 8 ok, 4 missing"));
  EXPECT_THAT(merge.err, HasSubstr(R"(cell 1 {"scenario.camera.td_s":0.02}: 4/6 done, 4 ok, 2 missing)"));
  EXPECT_EQ(plumbline("status out").code, 0);
  EXPECT_EQ(plumbline("run small.yaml --out out --shard 3/3").code, 2);
}

TEST_F(Sweep, RowsThatDifferAreRefusedByName) {
  RunOptions shard = options("out");
  shard.shard = Shard{0, 1};
  ASSERT_EQ(run_with(shard).code, 0);
  std::string text = read(folder_ / "out/shards/shard-0.jsonl");
  const std::size_t at = text.find("\"iterations\":") + 13;
  text.insert(at, "1");
  write("out/shards/other.jsonl", text);
  for (const char* command : {"merge out", "run out"}) {
    const ProgramResult result = plumbline(command);
    EXPECT_EQ(result.code, 2);
    EXPECT_THAT(result.err, HasSubstr("shard-0.jsonl:2: cell 0 trial 0 differs from its row in "));
    EXPECT_THAT(result.err, HasSubstr("other.jsonl"));
  }
  // A file of another sweep.
  ASSERT_EQ(plumbline("run small.yaml --out of --trials 1 --set scenario.camera.td_s=0.01").code, 0);
  fs::copy_file(folder_ / "of/results.jsonl", folder_ / "out/shards/other.jsonl", fs::copy_options::overwrite_existing);
  const ProgramResult foreign = plumbline("merge out");
  EXPECT_EQ(foreign.code, 2);
  EXPECT_THAT(foreign.err, HasSubstr("other.jsonl:1: is of another plan"));
}

TEST_F(Sweep, OneProgramWritesAtATime) {
  ASSERT_EQ(run_with(options("out")).code, 0);
  std::array<int, 2> locked{};
  ASSERT_EQ(::pipe(locked.data()), 0);
  for (const LockKind kind : {LockKind::kAlone, LockKind::kShared}) {
    const ::pid_t holder = ::fork();
    if (holder == 0) {
      const FolderLock lock(folder_ / "out", kind);
      if (::write(locked[1], "x", 1) != 1) std::abort();
      for (;;) ::pause();
    }
    char byte = 0;
    ASSERT_EQ(::read(locked[0], &byte, 1), 1);
    const std::string name = "in use by process " + std::to_string(holder) + " on host ";
    for (const char* command : {"run small.yaml --out out --fresh", "merge out"}) {
      const ProgramResult result = plumbline(command);
      EXPECT_EQ(result.code, 2);
      EXPECT_THAT(result.err, HasSubstr(name));
    }
    EXPECT_THAT(status("out")["writer"].get<std::string>(), HasSubstr(std::to_string(holder)));
    // Shards are written side by side.
    EXPECT_EQ(plumbline("run small.yaml --out out --shard 0/1").code, kind == LockKind::kShared ? 0 : 2);
    ::kill(holder, SIGKILL);
    ::waitpid(holder, nullptr, 0);
  }
  EXPECT_EQ(plumbline("merge out").code, 0);
}

TEST_F(Sweep, ReplayTellsWhatDiffers) {
  ASSERT_EQ(run_with(options("out")).code, 0);
  const ProgramResult same = plumbline("replay out 1 4 --dump seen");
  EXPECT_EQ(same.code, 0) << same.err;
  EXPECT_THAT(same.err, HasSubstr("identical to the stored row and series"));
  for (const char* file : {"dataset/mav0/imu0/data.csv", "dataset/truth", "estimate/estimate.tum", "series.json"}) {
    EXPECT_TRUE(fs::exists(folder_ / "seen" / file)) << file;
  }
  const auto row = nlohmann::json::parse(same.out);
  const std::string id = row["run_id"];
  EXPECT_EQ(row["trial"], 4);
  EXPECT_EQ(plumbline("replay out " + id).out, same.out);

  const fs::path series = folder_ / "out/series" / (id + ".json");
  save(series, "[]\n");
  EXPECT_EQ(plumbline("replay out 1 4").code, kExitInternal);
  EXPECT_THAT(plumbline("replay out 1 4").err, HasSubstr("differs from the stored series"));
  std::string results = read(folder_ / "out/results.jsonl");
  results.insert(results.find("\"iterations\":", results.find(id)) + 13, "1");
  save(folder_ / "out/results.jsonl", results);
  EXPECT_EQ(plumbline("replay out 1 4").code, kExitInternal);
  EXPECT_THAT(plumbline("replay out 1 4").err, HasSubstr("differs from the stored row"));

  for (const char* none : {"replay out 2 0", "replay out 0 6", "replay out -1 0", "replay out 0123456789abcdef"}) {
    EXPECT_EQ(plumbline(none).code, 2) << none;
  }
}

// A file system of our own, which only root may mount.
class Mounted {
 public:
  Mounted(fs::path at, const char* data, unsigned long flags) : at_(std::move(at)) {
    fs::create_directories(at_);
    ok_ = ::mount("tmpfs", at_.c_str(), "tmpfs", flags, data) == 0;
  }
  ~Mounted() {
    if (ok_) ::umount2(at_.c_str(), MNT_DETACH);
  }
  Mounted(const Mounted&) = delete;
  Mounted& operator=(const Mounted&) = delete;

  bool ok() const { return ok_; }
  bool remount(const char* data, unsigned long flags) const {
    return ::mount("tmpfs", at_.c_str(), "tmpfs", flags | MS_REMOUNT, data) == 0;
  }

 private:
  fs::path at_;
  bool ok_ = false;
};

TEST_F(Sweep, AFullDiskEndsTheRunAndLosesNothing) {
  ASSERT_EQ(run_with(options("undisturbed")).code, 0);
  const Mounted disk(folder_ / "disk", "size=48k", 0);
  if (!disk.ok()) GTEST_SKIP() << "cannot mount a small file system";
  const ProgramResult full = run_with(options("disk/out"));
  EXPECT_EQ(full.code, kExitInternal);
  EXPECT_THAT(full.err, HasSubstr("disk/out/"));
  EXPECT_THAT(full.err, HasSubstr("No space left on device"));
  EXPECT_FALSE(fs::exists(folder_ / "disk/out/results.jsonl"));
  ASSERT_TRUE(disk.remount("size=10m", 0));
  EXPECT_GT(status("disk/out")["done"], 0);
  ASSERT_EQ(run_with(options("disk/out")).code, 0);
  EXPECT_EQ(bytes("disk/out"), bytes("undisturbed"));
}

TEST_F(Sweep, AReadOnlyFolderIsNamed) {
  const Mounted disk(folder_ / "disk", "size=1m", 0);
  if (!disk.ok() || !disk.remount("size=1m", MS_RDONLY)) GTEST_SKIP() << "cannot mount a file system";
  const ProgramResult result = run_with(options("disk/out"));
  EXPECT_EQ(result.code, kExitInternal);
  EXPECT_THAT(result.err, HasSubstr("disk/out"));
  EXPECT_THAT(result.err, HasSubstr("Read-only file system"));
}

}  // namespace
}  // namespace plumbline::tools
