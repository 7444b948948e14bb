// The program as its users meet it: exit codes, messages, files, determinism.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iomanip>
#include <sstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <sys/wait.h>

#include "program_test.h"

namespace plumbline {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using Result = ProgramResult;

class CommandLine : public ProgramTest {
 protected:
  void SetUp() override {
    ProgramTest::SetUp();
    // A second of simulated work that takes a tenth of one.
    write("small.yaml", R"(experiment: {trials: 3, seed: 5, axes: {scenario.camera.td_s: [0, 0.02]}}
scenario:
  duration_s: 3
  imu: {gyro_noise_density_rad_s_sqrt_hz: 1.7e-4, gyro_bias_walk_rad_s2_sqrt_hz: 2.0e-5,
        accel_noise_density_m_s2_sqrt_hz: 2.0e-3, accel_bias_walk_m_s3_sqrt_hz: 3.0e-3}
  camera: {readout_s: 0.03}
  world: {landmarks: 1000}
  points: {per_frame: 20}
)");
  }
};

TEST_F(CommandLine, VersionHelpAndNoCommand) {
  const Result version = plumbline("--version");
  EXPECT_EQ(version.code, 0);
  EXPECT_THAT(version.out, HasSubstr("plumbline 0.1.0"));
  EXPECT_EQ(plumbline("--help").code, 0);
  EXPECT_EQ(plumbline("").code, 2);
  EXPECT_EQ(plumbline("fly").code, 2);
}

// The executable passes on what the function prints and returns.
TEST_F(CommandLine, TheExecutable) {
  const auto execute = [&](const std::string& arguments) {
    const std::string command = "cd '" + folder_.string() + "' && '" PLUMBLINE_PROGRAM "' " + arguments +
                                " >stdout.txt 2>stderr.txt </dev/null";
    const int status = std::system(command.c_str());
    return Result{WIFEXITED(status) ? WEXITSTATUS(status) : 128, read(folder_ / "stdout.txt"),
                  read(folder_ / "stderr.txt")};
  };
  for (const char* arguments : {"--version", "check small.yaml", "check small.yaml --set scenario.camera.rate_hz=0"}) {
    const Result expected = plumbline(arguments);
    const Result result = execute(arguments);
    EXPECT_EQ(result.code, expected.code) << arguments;
    EXPECT_EQ(result.out, expected.out) << arguments;
    EXPECT_EQ(result.err, expected.err) << arguments;
  }
}

TEST_F(CommandLine, RunWritesTheSameBytesForAnyNumberOfThreads) {
  const Result one = plumbline("run small.yaml --jobs 1 --out one");
  ASSERT_EQ(one.code, 0) << one.err;
  EXPECT_THAT(one.out, HasSubstr("td error"));
  EXPECT_THAT(one.out, HasSubstr("3/3 ok"));
  const std::string results = read(folder_ / "one/results.jsonl");
  EXPECT_EQ(std::count(results.begin(), results.end(), '\n'), 6);
  for (const char* jobs : {"2", "8"}) {
    const std::string out = std::string("jobs") + jobs;
    ASSERT_EQ(plumbline("run small.yaml --jobs " + std::string(jobs) + " --out " + out).code, 0);
    EXPECT_EQ(read(folder_ / out / "results.jsonl"), results);
    EXPECT_EQ(listing(folder_ / out), listing(folder_ / "one"));
    for (const std::string& name : listing(folder_ / "one/series")) {
      EXPECT_EQ(read(folder_ / out / "series" / name), read(folder_ / "one/series" / name));
    }
  }
  EXPECT_TRUE(fs::exists(folder_ / "one/timings.jsonl"));
  EXPECT_EQ(read(folder_ / "one/incidents.jsonl"), "");
}

TEST_F(CommandLine, SummaryIsJsonWithTheStatedKeys) {
  const Result result = plumbline("run small.yaml --json --out out");
  ASSERT_EQ(result.code, 0) << result.err;
  const auto summary = nlohmann::json::parse(result.out);
  EXPECT_EQ(summary, nlohmann::json::parse(read(folder_ / "out/summary.json")));
  EXPECT_EQ(summary["experiment"], "small");
  ASSERT_EQ(summary["cells"].size(), 2U);
  const auto& cell = summary["cells"][1];
  EXPECT_EQ(cell["axes"]["scenario.camera.td_s"], 0.02);
  EXPECT_EQ(cell["n"], 3);
  EXPECT_EQ(cell["n_ok"], 3);
  for (const char* name :
       {"ate_position_m", "ate_rotation_deg", "td_error_s", "readout_error_s", "extrinsic_position_m",
        "extrinsic_rotation_deg", "extrinsic", "final_pose", "final_velocity", "final_bias"}) {
    ASSERT_TRUE(cell["metrics"].contains(name)) << name;
    for (const char* figure : {"mean", "rmse", "median", "std"}) {
      EXPECT_TRUE(cell["metrics"][name].contains(figure)) << name << " " << figure;
    }
  }
  EXPECT_TRUE(cell["metrics"]["td_error_s"].contains("rmse_ci95"));
  EXPECT_THAT(summary["error"], HasSubstr("estimate - truth"));
  EXPECT_EQ(cell["metrics"]["extrinsic"]["nees_dof"], 6);
  EXPECT_TRUE(summary.contains("runtime_s"));
}

// The bound of each trial, its ratio to the RMSE, and what could be known at each instant.
TEST_F(CommandLine, RunGivesTheCramerRaoBound) {
  const std::string bound = "run small.yaml --json --trials 2 --set scenario.camera.td_s=0.01 --set eval.crlb=true ";
  const Result result = plumbline(bound + "--out out");
  ASSERT_EQ(result.code, 0) << result.err;
  const auto metrics = nlohmann::json::parse(result.out)["cells"][0]["metrics"];
  for (const char* name : {"ate_position_m", "td_error_s", "readout_error_s", "extrinsic_position_m", "final_pose",
                           "final_gyro_bias", "final_accel_bias"}) {
    EXPECT_GT(metrics[name]["crlb"], 0.0) << name;
    EXPECT_GT(metrics[name]["efficiency"], 0.0) << name;
  }
  EXPECT_LT(metrics["kappa2"]["rmse"], 0.05);
  const std::string series = listing(folder_ / "out/series").front();
  const auto causal = nlohmann::json::parse(read(folder_ / "out/series" / series))["bound"];
  EXPECT_GT(causal["td_s"][0], causal["td_s"].back());
  EXPECT_NEAR(causal["position_m"].back().get<double>(), causal["position_in_the_end_m"].back().get<double>(), 1e-6);
  EXPECT_GE(causal["position_m"][5], causal["position_in_the_end_m"][5]);

  // A mean of td that is not drawn says nothing of efficiency.
  const Result fixed = plumbline(bound + "--out fixed --set scenario.prior.td_mean_s=0.012");
  ASSERT_EQ(fixed.code, 0) << fixed.err;
  const auto with_fixed = nlohmann::json::parse(fixed.out)["cells"][0]["metrics"];
  EXPECT_FALSE(with_fixed["td_error_s"].contains("crlb"));
  EXPECT_TRUE(with_fixed["readout_error_s"].contains("crlb"));
  const Result global = plumbline(bound + "--out global --set scenario.prior.readout_mean_s=0.02");
  ASSERT_EQ(global.code, 0) << global.err;
  const auto with_global = nlohmann::json::parse(global.out)["cells"][0]["metrics"];
  EXPECT_TRUE(with_global["td_error_s"].contains("crlb"));
  for (const char* name : {"readout_error_s", "td_first_error_s", "calibration"}) {
    EXPECT_FALSE(with_global.at(name).contains("crlb")) << name;
  }

  const Result noiseless = plumbline(bound +
                                     "--out none --set scenario.camera.pixel_sigma_px=0 --set "
                                     "estimator.pixel_sigma_px=1");
  EXPECT_EQ(noiseless.code, 2);
  EXPECT_THAT(noiseless.err, HasSubstr("scenario.camera.pixel_sigma_px"));
}

// A camera that is not known is scored where it is free; where it is held nothing is claimed, and the summary says why.
TEST_F(CommandLine, RunScoresAnUnknownCamera) {
  const std::string run =
      "run small.yaml --json --trials 2 --set scenario.camera.td_s=0.01 --set eval.crlb=true --set "
      "scenario.prior.focal_sigma_px=4 --set scenario.prior.principal_point_sigma_px=4 --set "
      "estimator.type=sliding_window --set estimator.use=points ";
  const Result free = plumbline(run + "--out free --set estimator.estimate.intrinsics=true");
  ASSERT_EQ(free.code, 0) << free.err;
  const auto metrics = nlohmann::json::parse(free.out)["cells"][0]["metrics"];
  for (const char* name : {"focal_error_px", "principal_point_error_px", "intrinsics"}) {
    EXPECT_GT(metrics.at(name)["crlb"], 0.0) << name;
    EXPECT_GT(metrics.at(name)["rmse"], 0.0) << name;
  }
  EXPECT_EQ(metrics["intrinsics"]["nees_dof"], 4);
  EXPECT_EQ(metrics["calibration"]["nees_dof"], 12);

  const Result held = plumbline(run + "--out held --set estimator.max_cost_per_dof=1e6");
  ASSERT_EQ(held.code, 0) << held.err;
  const auto cell = nlohmann::json::parse(held.out)["cells"][0];
  EXPECT_FALSE(cell["metrics"].contains("intrinsics"));
  EXPECT_TRUE(cell["metrics"]["td_error_s"].contains("crlb"));
  EXPECT_FALSE(cell["metrics"]["td_error_s"].contains("nees_dof"));
  EXPECT_FALSE(cell["metrics"]["td_error_s"].contains("efficiency"));
  EXPECT_THAT(cell["note"], HasSubstr("the camera is held"));
}

TEST_F(CommandLine, ReplayGivesTheStoredRow) {
  ASSERT_EQ(plumbline("run small.yaml --out out").code, 0);
  const std::string results = read(folder_ / "out/results.jsonl");
  const auto row = nlohmann::json::parse(results.substr(results.rfind('\n', results.size() - 2) + 1));
  const std::string id = row["run_id"];
  const Result replay = plumbline("replay out " + id + " --out looked_at");
  EXPECT_EQ(replay.code, 0) << replay.err;
  EXPECT_THAT(replay.err, HasSubstr("identical"));
  EXPECT_THAT(results, HasSubstr(replay.out));
  EXPECT_TRUE(fs::exists(folder_ / "looked_at/dataset/mav0/imu0/data.csv"));
  EXPECT_EQ(plumbline("replay out 0123456789abcdef").code, 2);
}

TEST_F(CommandLine, SimulatePlotsWhereItSays) {
  write("scenario.yaml", "duration_s: 3\nworld: {type: rooms, landmarks: 1000}\npoints: {per_frame: 20}\n");
  const Result result = plumbline("simulate scenario.yaml --out data --plot");
  ASSERT_EQ(result.code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("plots: data/plots\n"));
  for (const char* name : {"trajectory.png", "frame.png"}) {
    EXPECT_TRUE(read(folder_ / "data/plots" / name).starts_with("\x89PNG")) << name;
    EXPECT_GT(fs::file_size(folder_ / "data/plots" / name), 10000U) << name;
  }
  ASSERT_EQ(plumbline("simulate scenario.yaml --out plain").code, 0);
  EXPECT_FALSE(fs::exists(folder_ / "plain/plots"));
}

// Simulated, written, read and estimated equals the run in memory; and the estimator never needs the truth.
TEST_F(CommandLine, TheDatasetOnDiskEstimatesToTheSameBytesWithoutItsTruth) {
  write("scenario.yaml",
        "duration_s: 3\nworld: {landmarks: 1000}\npoints: {per_frame: 20}\n"
        "imu: {gyro_noise_density_rad_s_sqrt_hz: 1.7e-4, gyro_bias_walk_rad_s2_sqrt_hz: 2.0e-5, "
        "accel_noise_density_m_s2_sqrt_hz: 2.0e-3, accel_bias_walk_m_s3_sqrt_hz: 3.0e-3}\n");
  ASSERT_EQ(plumbline("simulate scenario.yaml --out data --seed 3").code, 0);
  const Result with_truth = plumbline("estimate data --out with_truth");
  ASSERT_EQ(with_truth.code, 0) << with_truth.err;
  const Result scored = plumbline("evaluate with_truth --truth data --json");
  ASSERT_EQ(scored.code, 0) << scored.err;
  EXPECT_LT(nlohmann::json::parse(scored.out)["ate_position_m"]["rmse"], 0.1);

  // Scrambled, then gone.
  std::ofstream(folder_ / "data/truth/calibration.yaml") << "not: the truth\n";
  ASSERT_EQ(plumbline("estimate data --out scrambled").code, 0);
  fs::remove_all(folder_ / "data/truth");
  ASSERT_EQ(plumbline("estimate data --out without_truth").code, 0);
  for (const std::string& name : listing(folder_ / "with_truth")) {
    EXPECT_EQ(read(folder_ / "scrambled" / name), read(folder_ / "with_truth" / name));
    EXPECT_EQ(read(folder_ / "without_truth" / name), read(folder_ / "with_truth" / name));
  }
}

// The same trial in memory and by way of the disk.
TEST_F(CommandLine, MemoryAndDiskGiveTheSameEstimate) {
  ASSERT_EQ(plumbline("run small.yaml --out out --trials 1").code, 0);
  const std::string results = read(folder_ / "out/results.jsonl");
  const std::string id = nlohmann::json::parse(results.substr(0, results.find('\n')))["run_id"];
  ASSERT_EQ(plumbline("replay out " + id + " --out memory").code, 0);
  ASSERT_EQ(plumbline("estimate memory/dataset --out disk").code, 0);
  for (const std::string& name : listing(folder_ / "disk")) {
    EXPECT_EQ(read(folder_ / "disk" / name), read(folder_ / "memory/estimate" / name)) << name;
  }
}

TEST_F(CommandLine, BadInputIsOneLineExitTwoAndNothingWritten) {
  struct Case {
    const char* arguments;
    const char* message;
  };
  write("unknown.yaml", "experiment:\n  trials: 3\n  seeed: 1\n");
  write("type.yaml", "scenario:\n  camera:\n    rate_hz: fast\n");
  write("range.yaml", "scenario:\n  duration_s: -1\n");
  write("quaternion.yaml", "scenario:\n  camera:\n    extrinsic_rotation_xyzw: [0, 0, 0, 0.5]\n");
  write("include.yaml", "scenario: nowhere.yaml\n");
  write("axis.yaml", "experiment:\n  axes:\n    scenario.camera.td_s: 3\n");
  write("noise.yaml", "experiment: {trials: 1}\n");
  write("spline.yaml", "scenario:\n  trajectory:\n    type: spline\n    file: poses.txt\n");
  const std::array<Case, 13> cases = {{
      {"run absent.yaml", "absent.yaml"},
      {"run unknown.yaml", "unknown.yaml:3: experiment.seeed: unknown key; did you mean 'seed'?"},
      {"run type.yaml", "type.yaml:3: scenario.camera.rate_hz"},
      {"run range.yaml", "range.yaml:2: scenario.duration_s"},
      {"run quaternion.yaml", "quaternion.yaml:3: scenario.camera.extrinsic_rotation_xyzw: must be a unit quaternion"},
      {"run include.yaml", "include.yaml:1: scenario: no such file"},
      {"run axis.yaml", "axis.yaml:3: experiment.axes.scenario.camera.td_s: must be a list"},
      {"run noise.yaml", "estimator.imu.gyro_noise_density_rad_s_sqrt_hz: must be >= 1e-12"},
      {"run spline.yaml", "poses.txt"},
      {"run small.yaml --set scenario.camera.td=1", "--set scenario.camera.td=1: unknown key; did you mean 'td_s'?"},
      {"run small.yaml --set estimator.type=magic", "--set estimator.type=magic"},
      {"estimate nowhere --out est", "nowhere/meta.yaml"},
      {"evaluate nothing.tum --truth nothing.tum", "nothing.tum"},
  }};
  for (const Case& c : cases) {
    const Result result = plumbline(c.arguments);
    EXPECT_EQ(result.code, 2) << c.arguments;
    EXPECT_THAT(result.err, HasSubstr(c.message)) << c.arguments;
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    EXPECT_EQ(result.out, "") << c.arguments;
    EXPECT_FALSE(fs::exists(folder_ / "out")) << c.arguments;
    EXPECT_FALSE(fs::exists(folder_ / "est")) << c.arguments;
  }
}

TEST_F(CommandLine, ResultsOfAnotherConfigurationAreNotOverwritten) {
  ASSERT_EQ(plumbline("run small.yaml --out out --trials 2").code, 0);
  const std::string before = read(folder_ / "out/results.jsonl");
  const Result other = plumbline("run small.yaml --out out --set scenario.camera.pixel_sigma_px=2");
  EXPECT_EQ(other.code, 2);
  EXPECT_THAT(other.err, HasSubstr("--fresh"));
  EXPECT_EQ(plumbline("run small.yaml --out out --trials 1").code, 2);  // fewer trials would lose rows
  EXPECT_EQ(read(folder_ / "out/results.jsonl"), before);
  // More trials extend it, and the first rows stay as they were.
  ASSERT_EQ(plumbline("run small.yaml --out out --trials 3").code, 0);
  const std::string extended = read(folder_ / "out/results.jsonl");
  EXPECT_THAT(extended, HasSubstr(before.substr(0, before.find('\n'))));
  EXPECT_EQ(plumbline("run small.yaml --out out --fresh --set scenario.camera.pixel_sigma_px=2").code, 0);
}

TEST_F(CommandLine, SetOnAnAxisReplacesIt) {
  const Result result = plumbline("run small.yaml --json --trials 1 --set scenario.camera.td_s=0.01 --out out");
  ASSERT_EQ(result.code, 0) << result.err;
  const auto summary = nlohmann::json::parse(result.out);
  ASSERT_EQ(summary["cells"].size(), 1U);
  EXPECT_TRUE(summary["cells"][0]["axes"].empty());
}

TEST_F(CommandLine, OnlyRunsThoseCellsWithTheirOwnIdentity) {
  const auto run_ids = [&](const std::string& out) {
    std::vector<std::string> ids;
    std::ifstream results(folder_ / out / "results.jsonl");
    for (std::string line; std::getline(results, line);) ids.push_back(nlohmann::json::parse(line)["run_id"]);
    return ids;
  };
  ASSERT_EQ(plumbline("run small.yaml --trials 1 --out all").code, 0);
  ASSERT_EQ(plumbline("run small.yaml --trials 1 --out one --only scenario.camera.td_s=0.02").code, 0);
  EXPECT_EQ(run_ids("one"), std::vector<std::string>{run_ids("all").at(1)});
}

TEST_F(CommandLine, PlanWritesTheManifestOfTheRunAndNeverAnother) {
  ASSERT_EQ(plumbline("run small.yaml --trials 1 --out ran").code, 0);
  const Result result = plumbline("plan small.yaml --trials 1 --out planned");
  ASSERT_EQ(result.code, 0) << result.err;
  EXPECT_EQ(result.out, "small: 2 cells x 1 trials = 2 runs\nmanifest: planned/manifest.json\n");
  EXPECT_EQ(listing(folder_ / "planned"), std::vector<std::string>{"manifest.json"});
  EXPECT_EQ(read(folder_ / "planned/manifest.json"), read(folder_ / "ran/manifest.json"));
  EXPECT_EQ(plumbline("plan small.yaml --trials 1 --out planned").code, 0);
  const Result other = plumbline("plan small.yaml --trials 2 --out planned");
  EXPECT_EQ(other.code, 2);
  EXPECT_THAT(other.err, HasSubstr("planned/manifest.json: is of another plan"));
}

TEST_F(CommandLine, DryRunOfAPlanWritesNothing) {
  const std::vector<std::string> before = listing(folder_);
  const Result result = plumbline("plan small.yaml --out out --dry-run --jobs 2");
  ASSERT_EQ(result.code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("small: 2 cells x 3 trials = 6 runs\n"));
  EXPECT_THAT(result.out, HasSubstr("probe: cell {\"scenario.camera.td_s\":0}, "));
  EXPECT_THAT(result.out, HasSubstr("probe: cell {\"scenario.camera.td_s\":0.02}, "));
  EXPECT_THAT(result.out, HasSubstr("estimate from 2 trials: "));
  // Half the CPU time, to the three digits of each.
  double cpu_s = 0.0;
  double wall_s = 0.0;
  const std::string estimate = result.out.substr(result.out.find("estimate"));
  ASSERT_EQ(std::sscanf(estimate.c_str(), "estimate from 2 trials: %lf s of CPU, %lf s with 2", &cpu_s, &wall_s), 2);
  EXPECT_GT(cpu_s, 0.0);
  EXPECT_NEAR(wall_s, 0.5 * cpu_s, 0.01 * cpu_s);
  EXPECT_THAT(plumbline("plan small.yaml --dry-run --only scenario.camera.td_s=0").out,
              HasSubstr("estimate from 1 trial: "));
  EXPECT_EQ(listing(folder_), before);
}

TEST_F(CommandLine, FailedTrialsAreCountedAndDecideTheExitCode) {
  const std::string failing = "run small.yaml --trials 1 --set estimator.pixel_sigma_px=0.05 ";
  const Result result = plumbline(failing + "--out out --json");
  EXPECT_EQ(result.code, 1);
  const auto summary = nlohmann::json::parse(result.out);
  EXPECT_EQ(summary["cells"][0]["n"], 1);
  EXPECT_EQ(summary["cells"][0]["n_ok"], 0);
  EXPECT_THAT(read(folder_ / "out/results.jsonl"), HasSubstr("false_minimum"));
  EXPECT_EQ(plumbline(failing + "--out allowed --set experiment.max_failed_share=1").code, 0);
}

// The same trials with four times the pixel noise, which the estimator is told.
TEST_F(CommandLine, ComparePairsTwoFoldersBySeed) {
  const std::string trials = " --trials 10 --set scenario.camera.td_s=0.01";
  ASSERT_EQ(plumbline("run small.yaml --out a" + trials).code, 0);
  ASSERT_EQ(plumbline("run small.yaml --out b --set scenario.camera.pixel_sigma_px=4" + trials).code, 0);
  const Result worse = plumbline("compare a b --json");
  EXPECT_EQ(worse.code, 1) << worse.err;
  const auto json = nlohmann::json::parse(worse.out);
  EXPECT_EQ(json["worse"], true);
  ASSERT_EQ(json["cells"].size(), 1U);
  EXPECT_EQ(json["cells"][0]["n"], 10);
  EXPECT_GT(json["cells"][0]["metrics"]["ate_position_m"]["ratio"], 1.5);
  EXPECT_EQ(plumbline("compare b a").code, 0);
  const Result same = plumbline("compare a a --metric td_error_s");
  EXPECT_EQ(same.code, 0);
  EXPECT_THAT(same.out, HasSubstr("not significantly worse"));

  ASSERT_EQ(plumbline("run small.yaml --out c --trials 9 --set scenario.camera.td_s=0.01").code, 0);
  const Result unmatched = plumbline("compare a c");
  EXPECT_EQ(unmatched.code, 2);
  EXPECT_THAT(unmatched.err, HasSubstr("B has no trial 9 of seed 5"));
  EXPECT_EQ(unmatched.out, "");
  EXPECT_EQ(plumbline("compare a nowhere").code, 2);
  EXPECT_EQ(plumbline("compare a a --metric speed").code, 2);
}

TEST_F(CommandLine, CheckTellsWhatAFileIs) {
  const std::string configs = PLUMBLINE_SOURCE_DIR "/configs";
  for (const char* kind : {"experiments", "scenarios", "estimators"}) {
    for (const auto& file : fs::directory_iterator(fs::path(configs) / kind)) {
      std::string arguments = "check '" + file.path().string() + "'";
      const std::string name = file.path().stem().string();
      if (name.starts_with("recorded") || name == "openvins_mono") {
        EXPECT_EQ(plumbline(arguments).code, 2);  // names no pose file of its own
        std::string poses;
        for (int i = 0; i <= 150 * 20; ++i) poses += std::to_string(i * 0.05) + " 1 2 3 0 0 0 1\n";
        arguments += " --set scenario.trajectory.file=" + write("poses.tum", poses).string();
      }
      const Result result = plumbline(arguments);
      EXPECT_EQ(result.code, 0) << result.err;
      EXPECT_THAT(result.out, HasSubstr(": " + std::string(kind).substr(0, std::string(kind).size() - 1)));
    }
  }
  EXPECT_EQ(plumbline("check small.yaml --set scenario.camera.rate_hz=0").code, 2);
}

// By whatever keys a file has, also where few or both kinds have them.
TEST_F(CommandLine, CheckTellsScenariosFromEstimators) {
  struct Case {
    const char* text;
    const char* kind;
  };
  for (const auto& [text, kind] : {Case{"pixel_sigma_px: 2\n", "estimator"}, Case{"state_td_s: 0\n", "estimator"},
                                   Case{"max_iterations: 9\nimu: {gyro_noise_density_rad_s_sqrt_hz: 1}\n", "estimator"},
                                   Case{"imu: {rate_hz: 100}\n", "scenario"}, Case{"prior: {}\n", "scenario"},
                                   Case{"imu: {gyro_noise_density_rad_s_sqrt_hz: 1}\n", "scenario or estimator"},
                                   Case{"imu: {gyro_noise_density_rad_s_sqrt_hz: 0}\n", "scenario"}}) {
    write("some.yaml", text);
    const Result result = plumbline("check some.yaml");
    EXPECT_EQ(result.code, 0) << result.err;
    EXPECT_EQ(result.out, std::string("some.yaml: ") + kind + "\n") << text;
  }
  write("some.yaml", "imu: {gyro_noise_density_rad_s_sqrt_hz: -1}\n");
  EXPECT_EQ(plumbline("check some.yaml").code, 2);
  write("some.yaml", "colour: blue\n");
  EXPECT_THAT(plumbline("check some.yaml").err, HasSubstr("some.yaml:1: is neither"));
}

// A scenario's world is built, as an experiment's is.
TEST_F(CommandLine, CheckBuildsTheWorld) {
  write("walls.yaml", "duration_s: 3\nworld: {type: rooms, rooms: {margin_m: 1e4}}\n");
  EXPECT_EQ(plumbline("check walls.yaml").code, 2);
}

TEST_F(CommandLine, CheckNeedsAFileOrKeys) {
  EXPECT_EQ(plumbline("check").code, 2);
  EXPECT_EQ(plumbline("check --set scenario.duration_s=3").code, 2);
  EXPECT_EQ(plumbline("check --keys").code, 0);
}

// configs/README.md holds the table that the program prints.
TEST_F(CommandLine, ConfigsReadmeListsEveryKey) {
  const Result keys = plumbline("check --keys");
  ASSERT_EQ(keys.code, 0);
  EXPECT_THAT(read(PLUMBLINE_SOURCE_DIR "/configs/README.md"), HasSubstr(keys.out))
      << "paste the output of `plumbline check --keys` into configs/README.md";
}

}  // namespace
}  // namespace plumbline
