// Nights of a suite that takes a second: what they store, find, hand out and return.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "program_test.h"

namespace plumbline {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class NightlyTest : public ProgramTest {
 protected:
  void SetUp() override {
    ProgramTest::SetUp();
    write("small.yaml",
          "scenario:\n  duration_s: 2\n  world: {landmarks: 1000}\n  points: {per_frame: 20}\n"
          "  camera: {readout_s: 0.01, pixel_sigma_px: 1}\n"
          "  imu: {gyro_noise_density_rad_s_sqrt_hz: 1.7e-4, gyro_bias_walk_rad_s2_sqrt_hz: 2.0e-5, "
          "accel_noise_density_m_s2_sqrt_hz: 2.0e-3, accel_bias_walk_m_s3_sqrt_hz: 3.0e-3}\n"
          "estimator: {keyframe_rate_hz: 10, pixel_sigma_px: 1}\n");
    write("suite.yaml",
          "nightly: {trials: 12, fresh_trials: 3, quick_trials: 6, seed: 3}\n"
          "metrics: [ate_position_m, td_error_s]\nexperiments: [small.yaml]\n");
  }

  ProgramResult night(const std::string& options) const {
    return plumbline("nightly suite.yaml --history h.sqlite --jobs 1 --fresh-seed 7 " + options);
  }
};

TEST_F(NightlyTest, FirstThenUnchangedThenWorseThenGreenAgain) {
  const ProgramResult first = night("--out n1 --tag v1");
  ASSERT_EQ(first.code, 0) << first.err;
  EXPECT_THAT(first.out, HasSubstr("No baseline yet"));
  EXPECT_THAT(read(folder_ / "n1/junit.xml"), HasSubstr("<skipped message=\"no baseline"));

  const ProgramResult same = night("--out n2");
  EXPECT_EQ(same.code, 0) << same.err;
  EXPECT_THAT(same.out, HasSubstr("Unchanged: every figure is the baseline's, to the bit"));
  EXPECT_THAT(read(folder_ / "n2/junit.xml"), HasSubstr("failures=\"0\""));
  EXPECT_THAT(read(folder_ / "n2/summary.md"), HasSubstr("| small | identity | unchanged |"));

  // A believed pixel noise that is ten times too large, so that the IMU leads.
  const ProgramResult worse = night("--out n3 --set estimator.pixel_sigma_px=10");
  EXPECT_EQ(worse.code, 1) << worse.out << worse.err;
  EXPECT_THAT(worse.out, HasSubstr("Worse than the baseline"));
  const std::string junit = read(folder_ / "n3/junit.xml");
  EXPECT_THAT(junit, HasSubstr("<failure message=\"ATE position [mm]: RMSE "));
  EXPECT_THAT(junit, HasSubstr("baseline: night 2 of "));
  EXPECT_THAT(junit, HasSubstr("plumbline replay n3/small 0 "));
  EXPECT_THAT(read(folder_ / "n3/nightly.html"), HasSubstr("\"kind\":\"nightly\""));
  EXPECT_TRUE(fs::exists(folder_ / "n3/small/report.html"));

  // The red night is no baseline; the tag is.
  EXPECT_THAT(night("--out n4").out, HasSubstr("Unchanged"));
  EXPECT_THAT(night("--out n5 --baseline v1").out, HasSubstr("Baseline: night 1 of "));
}

TEST_F(NightlyTest, MoreNoiseInTheSceneIsComparedOnDemand) {
  ASSERT_EQ(night("--out n1").code, 0);
  const ProgramResult apart = night("--out n2 --set scenario.camera.pixel_sigma_px=1.2");
  EXPECT_EQ(apart.code, 0) << apart.out;
  EXPECT_THAT(apart.out, HasSubstr("Nothing is compared"));
  EXPECT_THAT(read(folder_ / "n2/junit.xml"), HasSubstr("no baseline over the same scenario"));
  const ProgramResult together = night("--out n3 --baseline last_green --across-scenarios");
  EXPECT_EQ(together.code, 0) << together.out;  // less noise is no reason for red
  EXPECT_THAT(read(folder_ / "n3/junit.xml"), HasSubstr("ATE position [mm]: RMSE "));
}

TEST_F(NightlyTest, QuickNightsAreComparedWithQuickOnes) {
  ASSERT_EQ(night("--out n1").code, 0);
  const ProgramResult quick = night("--out n2 --quick");
  EXPECT_EQ(quick.code, 0);
  EXPECT_THAT(quick.out, HasSubstr("No baseline yet"));
  EXPECT_THAT(night("--out n3 --quick").out, HasSubstr("Unchanged"));
}

TEST_F(NightlyTest, TheSuiteOfTheProjectIsSound) {
  const ProgramResult result =
      plumbline("nightly '" PLUMBLINE_SOURCE_DIR "/configs/nightly.yaml' --history h --baseline v9");
  EXPECT_THAT(result.err, HasSubstr("--baseline v9: no night"));  // after all of it was read
}

TEST_F(NightlyTest, BadInputIsNamedAndLeavesNothing) {
  const auto refusal = [&](const std::string& options) {
    const ProgramResult result = night(options);
    EXPECT_EQ(result.code, 2) << result.out;
    return result.err;
  };
  EXPECT_THAT(refusal("--baseline v9"), HasSubstr("--baseline v9: no night"));
  write("suite.yaml", "metrics: [ate_position_m]\nexperiments: [none.yaml]\n");
  EXPECT_THAT(refusal(""), HasSubstr("suite.yaml:2: experiments: no such file"));
  write("suite.yaml", "metrics: [ate]\nexperiments: [small.yaml]\n");
  EXPECT_THAT(refusal(""), HasSubstr("suite.yaml:1: metrics: no metric 'ate'"));
  write("suite.yaml", "nightly: {alhpa: 0.1}\nmetrics: [ate_position_m]\nexperiments: [small.yaml]\n");
  EXPECT_THAT(refusal(""), HasSubstr("suite.yaml:1: nightly.alhpa: unknown key"));
  EXPECT_FALSE(fs::exists(folder_ / "out"));
}

}  // namespace
}  // namespace plumbline
