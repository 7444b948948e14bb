// Trajectories and results in the files of other programs.
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

#include "core/pose_file.h"
#include "interoperability.h"
#include "sim/truth_files.h"

namespace plumbline {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using ::testing::HasSubstr;

using ForeignResults = Interoperability;

TEST_F(ForeignResults, TrajectoriesEvaluateTheSameInEveryFormat) {
  simulate("distortion: none");
  // Something to be compared with that is neither the truth nor rigidly moved.
  std::vector<core::StampedPose> bent;
  for (const auto& [t_ns, s] : sim::read_truth(folder_ / "data").states) {
    const double t = core::to_seconds(t_ns);
    bent.push_back({t_ns,
                    {s.T_W_B.q * core::exp_quaternion(Eigen::Vector3d(0.01 * t, 0, 0.02)),
                     s.T_W_B.p + Eigen::Vector3d(0.1 * t * t, 0, 0.05)}});
  }
  core::write_tum(folder_ / "bent.tum", bent);
  const std::map<std::string, std::string> files = {
      {"tum", "trajectory.tum"},    {"euroc", "mav0/state_groundtruth_estimate0/data.csv"},
      {"kalibr", "trajectory.tum"}, {"openvins", "groundtruth.txt"},
      {"vins", "groundtruth.csv"},  {"csv", "trajectory.csv"}};
  const json expected = json::parse(
      plumbline("evaluate data/truth/mav0/state_groundtruth_estimate0/data.csv --truth bent.tum --json").out);
  EXPECT_GT(expected["ate_position_m"]["rmse"], 0.01);
  for (const auto& [format, file] : files) {
    ASSERT_EQ(plumbline(fmt::format("export data --format {0} --out {0}", format)).code, 0);
    const ProgramResult result = plumbline(fmt::format("evaluate {}/{} --truth bent.tum --json", format, file));
    ASSERT_EQ(result.code, 0) << format << result.out << result.err;
    const json scored = json::parse(result.out);
    EXPECT_EQ(scored["matched"], expected["matched"]) << format;
    for (const char* metric : {"ate_position_m", "ate_rotation_deg"}) {
      EXPECT_NEAR(scored[metric]["rmse"].get<double>(), expected[metric]["rmse"].get<double>(), 1e-12) << format;
    }
  }
  EXPECT_THAT(read(folder_ / "vins/groundtruth.csv"), HasSubstr(",\n"));
}

TEST_F(ForeignResults, TumFilesAreWhatEvoReads) {
  simulate("distortion: none");
  ASSERT_EQ(plumbline("export data --format tum --out tum").code, 0);
  std::ifstream file(folder_ / "tum/trajectory.tum");
  double before = -1.0;
  int poses = 0;
  for (std::string line; std::getline(file, line);) {
    if (line.starts_with('#')) continue;
    ++poses;
    std::istringstream stream(line);
    std::vector<double> v;
    for (std::string word; stream >> word;) {
      const std::size_t point = word.find('.');
      ASSERT_NE(point, std::string::npos) << line;
      EXPECT_GE(std::min(word.find('e'), word.size()) - point - 1, 9U) << line;
      v.push_back(std::stod(word));
    }
    ASSERT_EQ(v.size(), 8U);
    EXPECT_GT(v[0], before);
    before = v[0];
    EXPECT_NEAR(std::hypot(std::hypot(v[4], v[5]), std::hypot(v[6], v[7])), 1.0, 1e-15);
  }
  EXPECT_EQ(poses, 501);
}

TEST_F(ForeignResults, OpenvinsStatesAreEvaluated) {
  simulate("distortion: none");
  // The truth, every state 0.1 m off along x; td 2 ms too large.
  std::ostringstream states;
  std::ostringstream deviations;
  states << "# timestamp(s) q p v bg ba cam_imu_dt num_cam cam0_k cam0_d cam0_rot cam0_trans .... etc\n";
  deviations << states.str();
  states.precision(9);
  states << std::fixed;
  int k = 0;
  for (const auto& [t_ns, s] : sim::read_truth(folder_ / "data").states) {
    if (++k % 10 != 0) continue;
    const auto& q = s.T_W_B.q;
    const auto& p = s.T_W_B.p;
    states << core::to_seconds(t_ns) << ' ' << q.x() << ' ' << q.y() << ' ' << q.z() << ' ' << q.w() << ' '
           << p.x() + 0.1 << ' ' << p.y() << ' ' << p.z()
           << " 0 0 0 0 0 0 0 0 0 0.0143000 1 458 457 367 248 0 0 0 0 0 0 0 1 0 0 0 \n";
    deviations << std::fixed << core::to_seconds(t_ns)
               << " 0.01 0.01 0.01 0.05 0.2 0.2 0 0 0 0 0 0 0 0 0 0.001 1 0 0 0 0 \n";
  }
  write("states.txt", states.str());
  write("std.txt", deviations.str());
  const ProgramResult result = plumbline("evaluate states.txt --std std.txt --truth data --align none --json");
  ASSERT_EQ(result.code, 0) << result.err << result.out;
  const json scored = json::parse(result.out);
  EXPECT_EQ(scored["stamp_clock"], "imu");
  EXPECT_NEAR(scored["ate_position_m"]["rmse"].get<double>(), 0.1, 1e-8);
  EXPECT_LT(scored["ate_rotation_deg"]["max"], 1e-5);  // nine decimals
  EXPECT_NEAR(scored["td"]["error_s"].get<double>(), 0.002, 1e-12);
  EXPECT_EQ(scored["td"]["sigma_s"], 0.001);
  EXPECT_TRUE(scored["td"]["convergence_s"].is_null());
  EXPECT_NEAR(scored["consistency"]["nees_position"].get<double>(), 4.0, 1e-6);  // (0.1 / 0.05)^2
  EXPECT_EQ(plumbline("evaluate states.txt --truth data --json").code, 0);
  EXPECT_THAT(plumbline("evaluate states.txt --truth data").out, HasSubstr("error 2.000000 ms, middle row"));

  write("short.txt", deviations.str().substr(0, deviations.str().size() / 2));
  EXPECT_EQ(plumbline("evaluate states.txt --std short.txt --truth data").code, 2);
  write("few.txt", "# timestamp(s) q p v bg ba cam_imu_dt num_cam\n1 0 0 0 1 0 0 0\n");
  EXPECT_EQ(plumbline("evaluate few.txt --truth data").err,
            "plumbline: few.txt:2: has 8 columns; td is in column 18\n");
}

// VINS stamps its results by the camera's clock.
TEST_F(ForeignResults, VinsResultsAreMovedByTheirTd) {
  simulate("distortion: none");
  ASSERT_EQ(plumbline("export data --format vins --out x").code, 0);
  std::istringstream truth(read(folder_ / "x/groundtruth.csv"));
  std::string late;
  for (std::string line; std::getline(truth, line);) {
    if (line.starts_with('#')) continue;
    late += std::to_string(std::stoll(line) - 14'000'000) + line.substr(line.find(',')) + "\n";
  }
  write("vins.csv", late);
  const json moved = json::parse(plumbline("evaluate vins.csv --td 0.014 --truth data --align none --json").out);
  EXPECT_LT(moved["ate_position_m"]["rmse"], 1e-12);
  EXPECT_EQ(moved["stamp_clock"], "camera");
  EXPECT_NEAR(moved["td"]["error_s"].get<double>(), 0.014 - 0.0123, 1e-15);
  const json unmoved = json::parse(plumbline("evaluate vins.csv --truth data --align none --json").out);
  EXPECT_GT(unmoved["ate_position_m"]["rmse"], 1e-3);
}

// td of the first row, 13.55 ms below that of the middle one, in the camera's clock.
TEST_F(ForeignResults, AHistoryOfTdTellsWhenItConverged) {
  simulate("distortion: none");
  ASSERT_EQ(plumbline("export data --format tum --out x").code, 0);
  fs::rename(folder_ / "x/trajectory.tum", folder_ / "x/estimate.tum");
  write("x/meta.yaml", "stamp_clock: imu\ntd_s: -0.001\ntd_reference_row: first\nreadout_s: 0.0271\n");
  write("x/td.csv", "#t_ns,td_s\n500000000,-0.001\n1000000000,0.001\n1500000000,-0.0021\n1900000000,-0.0003\n");
  const json scored = json::parse(plumbline("evaluate x --truth data --json").out);
  EXPECT_NEAR(scored["td"]["error_s"].get<double>(), 0.01255 - 0.0123, 1e-15);
  const double first_s = core::to_seconds(sim::read_truth(folder_ / "data").states.front().t_ns);
  EXPECT_NEAR(scored["td"]["convergence_s"].get<double>(), 1.5 - first_s, 1e-9);
  EXPECT_THAT(plumbline("evaluate x --truth data").out, HasSubstr("td within 1 ms for good: after 1.500 s"));
  write("x/td.csv", "#t_ns,td_s\n500000000,-0.001\n500000000,0.001\n");
  const ProgramResult twice = plumbline("evaluate x --truth data");
  EXPECT_EQ(twice.code, 2);
  EXPECT_EQ(twice.err, "plumbline: x/td.csv:3: stamps must increase\n");
}

}  // namespace
}  // namespace plumbline
