// `plumbline evaluate` as its users meet it: files of other programs, clocks, covariances, folders of runs.
#include <cmath>
#include <filesystem>
#include <iomanip>
#include <sstream>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "program_test.h"

namespace plumbline {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using Result = ProgramResult;

class EvaluateCommand : public ProgramTest {};

TEST_F(EvaluateCommand, TellsUnusableFromUnreadable) {
  std::string truth;
  for (int i = 0; i < 10; ++i) {
    truth += std::to_string(i) + ".0 " + std::to_string(i * i) + " " + std::to_string(i) + " 0 0 0 0 1\n";
  }
  write("truth.tum", truth);
  EXPECT_EQ(plumbline("evaluate truth.tum --truth truth.tum").code, 0);
  write("nan.tum", "0.0 nan 0 0 0 0 0 1\n" + truth.substr(truth.find('\n') + 1));
  const Result unusable = plumbline("evaluate nan.tum --truth truth.tum --json");
  EXPECT_EQ(unusable.code, 1);
  EXPECT_EQ(nlohmann::json::parse(unusable.out)["ok"], false);
  write("broken.tum", "0.0 1 2\n");
  EXPECT_EQ(plumbline("evaluate broken.tum --truth truth.tum").code, 2);
  EXPECT_EQ(plumbline("evaluate truth.tum --truth truth.tum --align sideways").code, 2);
}

// n poses a tenth of a second apart on a curve, moved by an offset in x and in time.
std::string curve(int n, double dx_m = 0.0, double dt_s = 0.0, const std::string& more = "") {
  std::ostringstream text;
  text << std::setprecision(12);
  for (int i = 0; i < n; ++i) {
    const double t = 0.1 * i;
    text << t + dt_s << ' ' << std::cos(t) + dx_m << ' ' << std::sin(t) << ' ' << 0.1 * t << " 0 0 0 1" << more << '\n';
  }
  return text.str();
}

TEST_F(EvaluateCommand, GivesTheStatedKeys) {
  write("truth.tum", curve(100));
  write("estimate.tum", curve(100, 0.5));
  const Result result = plumbline("evaluate estimate.tum --truth truth.tum --align none --rpe 1m,2s,20f,100m --json");
  ASSERT_EQ(result.code, 0) << result.err;
  const auto json = nlohmann::json::parse(result.out);
  EXPECT_EQ(json["alignment"], "none");
  EXPECT_EQ(json["matched"], 100);
  EXPECT_EQ(json["coverage"], 1.0);
  EXPECT_EQ(json["truth"], "exact");
  EXPECT_EQ(json["stamp_clock"], "undeclared");
  for (const char* name : {"ate_position_m", "ate_rotation_deg"}) {
    for (const char* figure : {"rmse", "mean", "median", "std", "min", "max"}) {
      EXPECT_TRUE(json[name].contains(figure)) << name << ' ' << figure;
    }
  }
  EXPECT_NEAR(json["ate_position_m"]["rmse"].get<double>(), 0.5, 1e-9);
  EXPECT_NEAR(json["axes"]["position_m"]["mean"][0].get<double>(), 0.5, 1e-9);
  ASSERT_EQ(json["rpe"].size(), 4U);
  EXPECT_EQ(json["rpe"][1]["delta"], "2s");
  EXPECT_EQ(json["rpe"][1]["pairs"], 80);
  EXPECT_LT(json["rpe"][1]["position_m"]["max"], 1e-9);
  EXPECT_EQ(json["rpe"][3]["pairs"], 0);
  EXPECT_EQ(plumbline("evaluate estimate.tum --truth truth.tum").code, 0);
  EXPECT_EQ(plumbline("evaluate estimate.tum --truth truth.tum --rpe 3x").code, 2);
  EXPECT_EQ(plumbline("evaluate estimate.tum --truth truth.tum --first 9 --first-s 2").code, 2);
}

// t_ns, position, quaternion with w first, and EuRoC's further columns, which are not read.
TEST_F(EvaluateCommand, ReadsEurocFiles) {
  const auto euroc = [](double dx_m, const std::string& quaternion) {
    std::ostringstream text;
    text << std::setprecision(12) << "#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], ...\n";
    for (int i = 0; i < 100; ++i) {
      const double t = 0.1 * i;
      text << i * 100'000'000LL << ',' << std::cos(t) + dx_m << ',' << std::sin(t) << ',' << 0.1 * t << ','
           << quaternion << ",0,0,0\n";
    }
    return text.str();
  };
  write("truth.csv", euroc(0.0, "1,0,0,0"));
  write("estimate.csv", euroc(0.25, "1,0,0,0"));
  write("estimate.tum", curve(100, 0.25));
  for (const char* name : {"estimate.csv", "estimate.tum"}) {
    const Result result = plumbline(std::string("evaluate ") + name + " --truth truth.csv --align none --json");
    ASSERT_EQ(result.code, 0) << result.err;
    const auto json = nlohmann::json::parse(result.out);
    EXPECT_EQ(json["matched"], 100);
    EXPECT_NEAR(json["ate_position_m"]["rmse"].get<double>(), 0.25, 1e-9);
    EXPECT_LT(json["ate_rotation_deg"]["max"], 1e-9);
  }
  write("estimate.csv", euroc(0.25, "nan,0,0,0"));
  const Result unusable = plumbline("evaluate estimate.csv --truth truth.csv --json");
  EXPECT_EQ(unusable.code, 1);
  EXPECT_EQ(nlohmann::json::parse(unusable.out)["ok"], false);
  EXPECT_EQ(plumbline("evaluate estimate.tum --truth estimate.csv").code, 2);  // a truth must be sound
}

// Stamps of the camera's clock are late by td = -30 ms there; t_imu = t_cam + td brings them back.
TEST_F(EvaluateCommand, ComparesInTheImuClock) {
  write("truth.tum", curve(100));
  for (const char* name : {"camera", "flipped", "imu"}) {
    fs::create_directory(folder_ / name);
    write(std::string(name) + "/estimate.tum", curve(100, 0.0, 0.03));
  }
  write("camera/meta.yaml", "stamp_clock: camera\ncalibration: {td_s: -0.03}\n");
  write("flipped/meta.yaml", "stamp_clock: camera\ntd_s: 0.03\n");
  write("imu/meta.yaml", "stamp_clock: imu\ntd_s: -0.03\n");
  const auto rmse = [&](const std::string& name) {
    const Result result = plumbline("evaluate " + name + " --truth truth.tum --align none --json");
    EXPECT_EQ(result.code, 0) << result.err << result.out;
    return nlohmann::json::parse(result.out)["ate_position_m"]["rmse"].get<double>();
  };
  EXPECT_LT(rmse("camera"), 1e-6);
  EXPECT_NEAR(rmse("imu"), 0.03, 1e-3);  // about 1 m/s
  EXPECT_NEAR(rmse("flipped"), 0.06, 1e-3);
  write("camera/meta.yaml", "stamp_clock: sun\n");
  const Result unknown = plumbline("evaluate camera --truth truth.tum");
  EXPECT_EQ(unknown.code, 2);
  EXPECT_THAT(unknown.err, HasSubstr("camera/meta.yaml:1: stamp_clock: must be imu or camera"));
  write("camera/meta.yaml", "stamp_clock: camera\n");
  EXPECT_EQ(plumbline("evaluate camera --truth truth.tum").code, 2);
  write("camera/meta.yaml", "schema: x\n");
  EXPECT_EQ(plumbline("evaluate camera --truth truth.tum").code, 2);
}

TEST_F(EvaluateCommand, AFolderOfRuns) {
  fs::create_directories(folder_ / "runs/c");
  fs::create_directories(folder_ / "truths");
  write("runs/a.tum", curve(100, 0.5));
  write("runs/b.txt", curve(50));
  write("runs/c/estimate.tum", curve(100, 1.5));
  write("runs/notes.md", "not a pose file");
  write("truth.tum", curve(100));
  const Result result = plumbline("evaluate runs --truth truth.tum --align none --json");
  EXPECT_EQ(result.code, 1) << result.err;  // b covers half
  const auto json = nlohmann::json::parse(result.out);
  EXPECT_EQ(json["n"], 3);
  EXPECT_EQ(json["n_ok"], 2);
  EXPECT_EQ(json["runs"][0]["name"], "a");
  EXPECT_NEAR(json["runs"][0]["ate_position_m"]["rmse"].get<double>(), 0.5, 1e-9);
  EXPECT_EQ(json["runs"][1]["ok"], false);
  EXPECT_THAT(json["runs"][1]["reason"].get<std::string>(), HasSubstr("coverage"));
  EXPECT_NEAR(json["runs"][2]["ate_position_m"]["rmse"].get<double>(), 1.5, 1e-9);
  const Result table = plumbline("evaluate runs --truth truth.tum");
  EXPECT_THAT(table.out, HasSubstr("failed: coverage"));
  EXPECT_THAT(table.out, HasSubstr("2/3 ok"));

  write("truths/a.tum", curve(100, 0.5));
  write("truths/b.tum", curve(50));
  const Result unmatched = plumbline("evaluate runs --truth truths");
  EXPECT_EQ(unmatched.code, 2);
  EXPECT_THAT(unmatched.err, HasSubstr("'c'"));
  EXPECT_EQ(unmatched.out, "");
  write("truths/c.tum", curve(100, 1.5));
  const Result matched = plumbline("evaluate runs --truth truths --align none --json");
  EXPECT_EQ(matched.code, 0) << matched.err;
  const nlohmann::json scores = nlohmann::json::parse(matched.out);
  for (const auto& run : scores["runs"]) EXPECT_LT(run["ate_position_m"]["max"], 1e-12);
  fs::create_directory(folder_ / "empty");
  EXPECT_EQ(plumbline("evaluate empty --truth truth.tum").code, 2);
}

// sigma 0.1 m and 0.1 rad: an error of 0.25 m in x is 2.5 sigma, NEES 6.25.
TEST_F(EvaluateCommand, ComparesStatedCovariancesUnaligned) {
  const std::string covariance = " 0.01 0 0 0 0 0 0.01 0 0 0 0 0.01 0 0 0 0.01 0 0 0.01 0 0.01";
  write("truth.tum", curve(100));
  write("estimate.tum", curve(100, 0.25, 0.0, covariance));
  const Result none = plumbline("evaluate estimate.tum --truth truth.tum --align none --json");
  ASSERT_EQ(none.code, 0) << none.err;
  const auto consistency = nlohmann::json::parse(none.out)["consistency"];
  EXPECT_NEAR(consistency["nees_pose"].get<double>(), 6.25, 1e-6);
  EXPECT_NEAR(consistency["nees_orientation"].get<double>(), 0.0, 1e-6);
  EXPECT_EQ(consistency["within_3_sigma"][0], 1.0);
  write("estimate.tum", curve(100, 0.35, 0.0, covariance));
  const Result wide = plumbline("evaluate estimate.tum --truth truth.tum --align none --json");
  EXPECT_EQ(nlohmann::json::parse(wide.out)["consistency"]["within_3_sigma"][0], 0.0);
  const auto aligned = nlohmann::json::parse(plumbline("evaluate estimate.tum --truth truth.tum --json").out);
  EXPECT_FALSE(aligned.contains("consistency"));
  EXPECT_TRUE(aligned.contains("no_consistency"));
}

}  // namespace
}  // namespace plumbline
