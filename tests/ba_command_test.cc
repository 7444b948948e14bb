// `plumbline ba` and `plumbline simulate-ba` as their users meet them.
#include <filesystem>
#include <fstream>
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

class BaCommand : public ProgramTest {
 protected:
  void simulate() const { ASSERT_EQ(plumbline("simulate-ba --out w --cameras 8 --points 100 --seed 3").code, 0); }
};

TEST_F(BaCommand, JsonHasTheKeysThatScriptsRelyOn) {
  simulate();
  const Result result = plumbline("ba w/problem.txt --json");
  ASSERT_EQ(result.code, 0) << result.err;
  const auto json = nlohmann::ordered_json::parse(result.out);
  std::vector<std::string> keys;
  for (const auto& [key, value] : json.items()) keys.push_back(key);
  EXPECT_THAT(keys, ::testing::ElementsAre("cameras", "points", "observations", "initial_cost", "final_cost",
                                           "iterations", "rmse_px", "time_s"));
  EXPECT_EQ(json["cameras"], 8);
  EXPECT_LT(json["final_cost"].get<double>(), json["initial_cost"].get<double>());
  // Noise of 0.5 px in u and v, less what the parameters take up: below 0.5 sqrt(2).
  EXPECT_NEAR(json["rmse_px"].get<double>(), 0.6, 0.12);
}

TEST_F(BaCommand, TruthIsFoundAndTheResultIsAProblemAgain) {
  simulate();
  for (const char* form : {"angle_axis", "left"}) {
    const Result first =
        plumbline(std::string("ba w/problem.txt --truth w/truth.txt --out adjusted.bz2 --json --rotation ") + form);
    ASSERT_EQ(first.code, 0) << first.err;
    const auto json = nlohmann::json::parse(first.out);
    EXPECT_LT(json["truth"]["camera_position_rmse"].get<double>(), 0.05);
    EXPECT_LT(json["truth"]["camera_rotation_rmse_deg"].get<double>(), 0.5);
    EXPECT_LT(json["truth"]["point_rmse"].get<double>(), 0.02);
    const auto again = nlohmann::json::parse(plumbline("ba adjusted.bz2 --json").out);
    EXPECT_NEAR(again["initial_cost"].get<double>() / json["final_cost"].get<double>(), 1.0, 1e-9);
  }
  EXPECT_THAT(plumbline("ba w/problem.txt --truth w/truth.txt").out, HasSubstr("after Sim3 alignment"));
}

TEST_F(BaCommand, EverySolverByName) {
  simulate();
  for (const char* solver : {"dense_schur", "sparse_schur", "iterative_schur"}) {
    const Result result = plumbline(std::string("ba w/problem.txt --solver ") + solver);
    EXPECT_EQ(result.code, 0) << result.err;
    EXPECT_THAT(result.out, HasSubstr(solver));
  }
  EXPECT_EQ(plumbline("ba w/problem.txt --solver cholesky").code, 2);
  EXPECT_EQ(plumbline("ba w/problem.txt --rotation quaternion").code, 2);
}

TEST_F(BaCommand, BadInputIsTwoAndWritesNothing) {
  simulate();
  std::ofstream(folder_ / "bad.txt") << "1 1 1\n0 7 1 2\n1 2 3 4 5 6 7 8 9\n1 2 3\n";
  const Result result = plumbline("ba bad.txt --out adjusted.txt --json");
  EXPECT_EQ(result.code, 2);
  EXPECT_EQ(result.out, "");
  EXPECT_EQ(result.err, "plumbline: bad.txt:2: the point of an observation must be from 0 to 0, not 7\n");
  EXPECT_FALSE(fs::exists(folder_ / "adjusted.txt"));
  EXPECT_EQ(plumbline("ba none.txt").code, 2);
  EXPECT_EQ(plumbline("simulate-ba --out w").code, 2);  // exists already
  ASSERT_EQ(plumbline("simulate-ba --out other --cameras 9 --points 100").code, 0);
  const Result mismatch = plumbline("ba w/problem.txt --truth other/truth.txt --out adjusted.txt");
  EXPECT_EQ(mismatch.code, 2);
  EXPECT_THAT(mismatch.err, HasSubstr("other/truth.txt: 9 cameras"));
  EXPECT_FALSE(fs::exists(folder_ / "adjusted.txt"));
}

TEST_F(BaCommand, EndingAtTheLimitOfIterationsIsOne) {
  simulate();
  const Result result = plumbline("ba w/problem.txt --iterations 1");
  EXPECT_EQ(result.code, 1);
  EXPECT_THAT(result.out, HasSubstr("iteration_limit"));
}

}  // namespace
}  // namespace plumbline
