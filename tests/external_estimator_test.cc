// Programs of others as estimators: what they are given, how they are scored, and how they fail.
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "core/pose_file.h"
#include "program_test.h"

namespace plumbline {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using ::testing::HasSubstr;

const std::string kPython = PLUMBLINE_SOURCE_DIR "/tools/examples/dead_reckoning.py";
const std::string kCpp = PLUMBLINE_EXAMPLE;

class ExternalEstimator : public ProgramTest {
 protected:
  void SetUp() override {
    ProgramTest::SetUp();
    write("scenario.yaml", R"(duration_s: 4
imu: {gyro_noise_density_rad_s_sqrt_hz: 1.7e-4, gyro_bias_walk_rad_s2_sqrt_hz: 2.0e-5,
      accel_noise_density_m_s2_sqrt_hz: 2.0e-3, accel_bias_walk_m_s3_sqrt_hz: 3.0e-3}
camera: {td_s: 0.02, readout_s: 0.03}
world: {landmarks: 1000}
points: {per_frame: 20}
)");
    // An address space is no measure of what a sanitizer takes.
    write("experiment.yaml",
          "experiment: {trials: 2}\nscenario: scenario.yaml\n"
          "estimator: {type: external, external: {memory_limit_mb: 0}}\n");
  }

  // A program in the folder; returns the option that chooses it.
  std::string script(const std::string& name, const std::string& text) const {
    const fs::path path = write(name, "#!/bin/sh\n" + text);
    fs::permissions(path, fs::perms::owner_exec, fs::perm_options::add);
    return choose(path);
  }

  static std::string choose(const fs::path& program) {
    return " --set estimator.external.command=" + program.string() + " ";
  }

  std::vector<json> rows(const std::string& out) const {
    std::vector<json> result;
    std::ifstream file(folder_ / out / "results.jsonl");
    for (std::string line; std::getline(file, line);) result.push_back(json::parse(line));
    return result;
  }

  // Of the only trial's row.
  std::string reason_of(const std::string& options) const {
    fs::remove_all(folder_ / "out");
    plumbline("run experiment.yaml --trials 1 --jobs 1 --out out " + options);
    const std::vector<json> all = rows("out");
    if (all.size() != 1 || all[0]["ok"] == true) return "no failed row";
    return all[0]["status"].get<std::string>() + ": " + all[0]["reason"].get<std::string>();
  }
};

// Without noise and from the true state, what remains is the order of the integration: a jerk of some 10 m/s^3 (here
// also of the rotating force) gives j dt^3 / 12 a step, over the 1600 steps of 5 ms.
TEST_F(ExternalEstimator, TheExamplesFindTheirWay) {
  write("exact.yaml",
        "duration_s: 8\ncamera: {td_s: 0.02, readout_s: 0.03, pixel_sigma_px: 0}\nprior: {means: truth}\n"
        "world: {landmarks: 100}\npoints: {per_frame: 5}\n");
  ASSERT_EQ(plumbline("simulate exact.yaml --out data").code, 0);
  const std::string options = " --set estimator.type=external --set estimator.external.memory_limit_mb=0";
  for (const auto& [name, program] : {std::pair("python", kPython), std::pair("cpp", kCpp)}) {
    const ProgramResult result = plumbline(std::string("estimate data --out ") + name + options + choose(program));
    ASSERT_EQ(result.code, 0) << result.err;
    const ProgramResult score = plumbline(std::string("evaluate ") + name + " --truth data --align none --json");
    ASSERT_EQ(score.code, 0) << score.out;
    const json scored = json::parse(score.out);
    EXPECT_LT(scored["ate_position_m"]["rmse"], 2e-3);
    EXPECT_EQ(scored["stamp_clock"], "camera");
    EXPECT_EQ(scored["stamps_moved_by_s"], 0.02);
  }
  // The two do the same sums.
  const auto python = core::read_tum(folder_ / "python/estimate.tum");
  const auto cpp = core::read_tum(folder_ / "cpp/estimate.tum");
  ASSERT_EQ(python.size(), cpp.size());
  ASSERT_GT(python.size(), 140U);
  for (std::size_t i = 0; i < cpp.size(); ++i) {
    EXPECT_EQ(python[i].t_ns, cpp[i].t_ns);
    EXPECT_LT((python[i].T_W_B.p - cpp[i].T_W_B.p).norm(), 1e-9);
    EXPECT_LT(core::rotation_angle(python[i].T_W_B.q.conjugate() * cpp[i].T_W_B.q), 1e-9);
  }
}

TEST_F(ExternalEstimator, IsSweptByEveryLauncherAndReplayed) {
  for (const char* launcher : {"processes", "threads"}) {
    const ProgramResult result = plumbline("run experiment.yaml --jobs 2 --out " + std::string(launcher) +
                                           " --launcher " + launcher + choose(kPython));
    ASSERT_EQ(result.code, 0) << result.err;
  }
  EXPECT_EQ(read(folder_ / "processes/results.jsonl"), read(folder_ / "threads/results.jsonl"));
  const std::vector<json> all = rows("processes");
  ASSERT_EQ(all.size(), 2U);
  for (const json& row : all) {
    EXPECT_EQ(row["status"], "converged");
    const json& metrics = row["metrics"];
    // td is the prior's mean, which is drawn.
    EXPECT_GT(std::abs(metrics["td_error_s"]["value"].get<double>()), 1e-5);
    EXPECT_FALSE(metrics["td_error_s"].contains("nees"));
    for (const char* unstated : {"readout_error_s", "td_first_error_s", "extrinsic", "calibration", "final_velocity",
                                 "final_bias", "final_state", "joint"}) {
      EXPECT_FALSE(metrics.contains(unstated)) << unstated;
    }
  }
  EXPECT_NE(all[0]["metrics"]["td_error_s"], all[1]["metrics"]["td_error_s"]);
  const ProgramResult again = plumbline("replay threads 0 1 --dump dump");
  EXPECT_EQ(again.code, 0) << again.err;
  EXPECT_THAT(again.err, HasSubstr("identical to the stored row and series"));
  EXPECT_TRUE(fs::exists(folder_ / "dump/estimate/estimate.tum"));
  EXPECT_TRUE(fs::exists(folder_ / "dump/dataset/truth"));
}

// The program's own estimator, called as somebody else's.
TEST_F(ExternalEstimator, IsScoredLikeOurOwn) {
  const std::string own = script("own", "'" PLUMBLINE_PROGRAM
                                        "' estimate \"$2\" --out \"$4/own\" --set "
                                        "estimator.keyframe_rate_hz=5 && mv \"$4/own/\"* \"$4\"\n");
  ASSERT_EQ(plumbline("run experiment.yaml --trials 1 --out external" + own).code, 0);
  ASSERT_EQ(plumbline("run experiment.yaml --trials 1 --out batch --set estimator.type=batch "
                      "--set estimator.keyframe_rate_hz=5")
                .code,
            0);
  const json external = rows("external").at(0)["metrics"];
  const json batch = rows("batch").at(0)["metrics"];
  ASSERT_GE(external.size(), 10U);
  for (const auto& [name, metric] : external.items()) {
    // Text keeps every bit; a quaternion is normalised again.
    EXPECT_NEAR(metric["value"].get<double>(), batch[name]["value"].get<double>(), 1e-12) << name;
    ASSERT_EQ(metric.contains("nees"), batch[name].contains("nees")) << name;
    if (!metric.contains("nees")) continue;
    const double nees = batch[name]["nees"].get<double>();
    EXPECT_NEAR(metric["nees"].get<double>(), nees, 1e-6 * nees) << name;
  }
  for (const char* name : {"ate_position_m", "td_error_s", "td_first_error_s", "readout_error_s", "extrinsic",
                           "calibration", "final_pose"}) {
    EXPECT_TRUE(external.contains(name)) << name;
  }
}

TEST_F(ExternalEstimator, IsGivenMeasurementsOnly) {
  EXPECT_EQ(reason_of(script("list", "cd \"$2\" && echo $(find . -type f | LC_ALL=C sort) >&2; exit 1\n")),
            "external: exit code 1: ./mav0/cam0/data.csv ./mav0/cam0/points.csv ./mav0/cam0/sensor.yaml "
            "./mav0/imu0/data.csv ./mav0/imu0/sensor.yaml ./meta.yaml ./prior.yaml");
  EXPECT_EQ(reason_of(script("seed", "echo $(grep -E 'seed|trial|hash' \"$2/meta.yaml\") >&2; exit 1\n")),
            "external: exit code 1: config_hash: \"\" seed: 0 trial: 0");
}

TEST_F(ExternalEstimator, HasItsArgumentsAndEnvironment) {
  const std::string words =
      "--set 'estimator.external.arguments=--fast  -k 3' "
      "--set 'estimator.external.environment=MODE=7 OMP_NUM_THREADS=4' ";
  EXPECT_EQ(reason_of(script("show",
                             "echo \"$1 $2 $3 $4 $6 $MODE $OMP_NUM_THREADS $OPENBLAS_NUM_THREADS\" >&2\n"
                             "[ \"$5\" = \"$PLUMBLINE_DATASET\" ] && [ \"$7\" = \"$PLUMBLINE_OUT\" ] && "
                             "[ \"$PWD\" = \"$7\" ] && exit 5; exit 6\n") +
                      words),
            "external: exit code 5: --fast -k 3 --dataset --out 7 4 1");
}

TEST_F(ExternalEstimator, EveryFailureIsARowThatNamesIt) {
  const std::string write_poses = "for i in 1 2 3 4 5; do echo \"$i.5 $i 0 0 0 0 0 1\"; done > estimate.tum\n";
  const std::map<std::string, std::string> cases = {
      {"echo first >&2; echo \"no calibration in $2/x\" >&2; echo >&2; exit 3",
       "external: exit code 3: no calibration in dataset/x"},
      {"kill -SEGV $$", "external: killed by SIGSEGV"},
      {"exit 0", "external: meta.yaml: "},
      {"echo 'td_s: 1' > meta.yaml", "external: meta.yaml:1: stamp_clock: missing: imu or camera"},
      {"printf 'stamp_clock: imu\\ntd_s: 0\\n' > meta.yaml",
       "external: meta.yaml: td_reference_row: missing: the row that td_s is of, middle or first"},
      {"echo 'stamp_clock: imu' > meta.yaml", "external: estimate.tum: "},
      {"echo 'stamp_clock: imu' > meta.yaml; echo '1 2 3' > estimate.tum",
       "external: estimate.tum:1: a pose needs 8 columns"},
      {"echo 'stamp_clock: imu' > meta.yaml; for i in 1 2 3; do echo \"$i nan 0 0 0 0 0 1\"; done > estimate.tum",
       "unusable: "},
      {"echo 'stamp_clock: imu' > meta.yaml; " + write_poses,
       "unusable: the state at 4500000000 ns lies outside the recording"},
      {"printf 'stamp_clock: imu\\nstatus: diverged\\nreason: lost\\n' > meta.yaml", "diverged: lost"},
      {"echo 'stamp_clock: imu' > meta.yaml; for i in 1 2 3 4 5 6; do echo \"1.$i 0.$i 0 0 0 0 0 1\"; done > "
       "estimate.tum",
       "unusable: the poses cover "},
  };
  int k = 0;
  for (const auto& [text, reason] : cases) {
    EXPECT_THAT(reason_of(script("fails" + std::to_string(k++), text + "\n")), ::testing::StartsWith(reason)) << text;
  }
  // An interpreter that is not there.
  write("nothing", "#!/no/such/interpreter\n");
  fs::permissions(folder_ / "nothing", fs::perms::owner_exec, fs::perm_options::add);
  EXPECT_EQ(reason_of(choose(folder_ / "nothing")), "external: exit code 127: cannot be executed");
}

TEST_F(ExternalEstimator, KeepsItsLimits) {
  const std::string second = "--set estimator.external.cpu_limit_s=1";
  EXPECT_EQ(reason_of(script("busy", "while :; do :; done\n") + second),
            "external: more than 1 s of processor time (estimator.external.cpu_limit_s)");
  EXPECT_EQ(reason_of(script("sleepy", "sleep 100\n") + "--set estimator.external.cpu_limit_s=0.1"),
            "external: not done after ten times 0.1 s (estimator.external.cpu_limit_s)");
  EXPECT_THAT(reason_of(script("greedy", "exec python3 -c 'x = bytearray(3 << 30)'\n") +
                        "--set estimator.external.memory_limit_mb=1000"),
              HasSubstr("exit code 1: MemoryError"));
}

// It may be tried again: the kernel kills what is in its way, whatever the program.
TEST_F(ExternalEstimator, WhatTheMachineKillsIsAnIncident) {
  const ProgramResult result =
      plumbline("run experiment.yaml --trials 1 --out out" + script("killed", "kill -KILL $$\n"));
  EXPECT_EQ(result.code, 3);
  EXPECT_THAT(read(folder_ / "out/incidents.jsonl") + result.err, HasSubstr("its program was killed"));
  EXPECT_THAT(rows("out"), ::testing::IsEmpty());
}

TEST_F(ExternalEstimator, LeavesNothingBehind) {
  fs::create_directory(folder_ / "tmp");
  ::setenv("TMPDIR", (folder_ / "tmp").c_str(), 1);
  const std::string pid_file = (folder_ / "pid").string();
  EXPECT_EQ(reason_of(script("forks", "sleep 1000 &\necho $! > " + pid_file + "\nexit 4\n")), "external: exit code 4");
  ::unsetenv("TMPDIR");
  EXPECT_TRUE(fs::is_empty(folder_ / "tmp"));
  const pid_t left = std::stoi(read(pid_file));
  for (int i = 0; i < 100 && ::kill(left, 0) == 0; ++i) std::this_thread::sleep_for(std::chrono::milliseconds(20));
  // Gone, or dead and not yet buried by whoever took it over.
  const std::string state = read("/proc/" + std::to_string(left) + "/stat");
  EXPECT_TRUE(state.empty() || state.find(") Z ") != std::string::npos) << state;
}

TEST_F(ExternalEstimator, ACommandMustBeAProgram) {
  const ProgramResult none = plumbline("run experiment.yaml --out out");
  EXPECT_EQ(none.code, 2);
  EXPECT_THAT(none.err, HasSubstr("experiment.yaml:3: estimator.external.command: must name the program of"));
  const ProgramResult text = plumbline("run experiment.yaml --out out" + choose(folder_ / "scenario.yaml"));
  EXPECT_EQ(text.code, 2);
  EXPECT_THAT(text.err, HasSubstr("scenario.yaml is no program"));
  const ProgramResult environment =
      plumbline("run experiment.yaml --out out --set estimator.external.environment=FAST" + choose(kPython));
  EXPECT_THAT(environment.err, HasSubstr("estimator.external.environment=FAST: 'FAST' is not NAME=VALUE"));
  EXPECT_FALSE(fs::exists(folder_ / "out"));
}

// td.csv, pose covariances and a td of the first row.
TEST_F(ExternalEstimator, StatesWhatItKnows) {
  const std::string states =
      script("states",
             "'" + kPython +
                 "' \"$@\" || exit 1\n"
                 "sed -i 's/$/ 1 0 0 0 0 0 1 0 0 0 0 1 0 0 0 1 0 0 1 0 1/' estimate.tum\n"
                 "printf 'stamp_clock: camera\\ntd_s: 0.004\\ntd_sigma_s: 0.001\\ntd_reference_row: first\\nreadout_s: "
                 "0.03\\n' > meta.yaml\n"
                 "printf '#t_ns,td_s,sigma_s\\n1000000000,0.5,0.1\\n2000000000,0.0049,0.1\\n3000000000,0.005,0.1\\n' > "
                 "td.csv\n");
  ASSERT_EQ(plumbline("run experiment.yaml --trials 1 --out out" + states).code, 0);
  const json metrics = rows("out").at(0)["metrics"];
  // The truth is 0.02 s of the middle row, hence 0.005 s of the first.
  EXPECT_NEAR(metrics["td_error_s"]["value"].get<double>(), -0.001, 1e-12);
  EXPECT_NEAR(metrics["td_error_s"]["nees"].get<double>(), 1.0, 1e-9);
  EXPECT_NEAR(metrics["td_first_error_s"]["value"].get<double>(), -0.001, 1e-12);
  EXPECT_NEAR(metrics["readout_error_s"]["value"].get<double>(), 0.0, 1e-12);
  EXPECT_EQ(metrics["final_position"]["nees_dof"], 3);
  const double error_m = metrics["final_position"]["value"].get<double>();
  EXPECT_NEAR(metrics["final_position"]["nees"].get<double>(), error_m * error_m, 1e-9);
  // The first instant after which td stays within 1 ms, from the first pose.
  EXPECT_TRUE(metrics.contains("td_convergence_s"));
  EXPECT_NEAR(metrics["td_convergence_s"]["value"].get<double>(), 1.75, 0.06);
}

}  // namespace
}  // namespace plumbline
