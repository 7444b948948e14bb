// Axes of experiments: which cells they span, in which order, and that a cell is the same however it was written down.
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "core/error.h"
#include "program_test.h"
#include "tools/experiment.h"

namespace plumbline::tools {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr const char* kTd = "scenario.camera.td_s";

class SweepTest : public ProgramTest {
 protected:
  void SetUp() override {
    ProgramTest::SetUp();
    write("scenario.yaml",
          "duration_s: 1\nimu: {rate_hz: 50, gyro_noise_density_rad_s_sqrt_hz: 1e-3, gyro_bias_walk_rad_s2_sqrt_hz: "
          "1e-4, accel_noise_density_m_s2_sqrt_hz: 1e-2, accel_bias_walk_m_s3_sqrt_hz: 1e-3}\n"
          "points: {per_frame: 5}\nworld: {landmarks: 100}\n");
  }

  // Of `experiment: {EXPERIMENT}`.
  Plan plan(const std::string& experiment, const std::vector<std::string>& set = {},
            const std::vector<std::string>& only = {}) const {
    return load_plan(write("x.yaml", "scenario: scenario.yaml\nexperiment:\n" + experiment), set, only);
  }

  std::string refusal(const std::string& experiment, const std::vector<std::string>& set = {},
                      const std::vector<std::string>& only = {}) const {
    try {
      plan(experiment, set, only);
    } catch (const core::ConfigError& error) {
      return error.what();
    }
    return "accepted";
  }

  static std::vector<std::string> axes(const Plan& plan) {
    std::vector<std::string> all;
    for (const Cell& cell : plan.cells) {
      std::vector<std::string> values;
      for (const auto& item : cell.axes.items()) values.push_back(item.value().dump());
      all.push_back(fmt::format("{}", fmt::join(values, " ")));
    }
    return all;
  }
};

TEST_F(SweepTest, TheLastAxisVariesFastest) {
  EXPECT_THAT(axes(plan("  axes: {scenario.camera.td_s: [0, 0.02], scenario.camera.readout_s: [0.01, 0.03]}\n")),
              ElementsAre("0 0.01", "0 0.03", "0.02 0.01", "0.02 0.03"));
}

TEST_F(SweepTest, LinspaceHitsItsEndsToTheBit) {
  const Plan p = plan("  axes: {scenario.camera.td_s: {linspace: [-0.1, 0.3, 8]}}\n");
  ASSERT_EQ(p.cells.size(), 8U);
  for (int i = 0; i < 8; ++i) {
    const double expected = i == 0 ? -0.1 : i == 7 ? 0.3 : -0.1 + (0.3 - -0.1) * i / 7;
    EXPECT_EQ(p.cells[i].experiment.scenario.camera.td_s, expected) << i;
    EXPECT_EQ(p.cells[i].axes[kTd], expected) << i;
  }
  // What the formula alone would give for the last one.
  EXPECT_NE(-0.1 + (0.3 - -0.1) * 7 / 7, 0.3);
}

TEST_F(SweepTest, LogspaceIsOfTheEndsThemselves) {
  EXPECT_THAT(axes(plan("  axes: {scenario.camera.pixel_sigma_px: {logspace: [0.01, 10, 4]}}\n")),
              ElementsAre("0.01", "0.1", "1", "10"));
  // 2^(1/2), to 12 digits.
  EXPECT_THAT(axes(plan("  axes: {scenario.camera.pixel_sigma_px: {logspace: [1, 2, 3]}}\n")),
              ElementsAre("1", "1.41421356237", "2"));
}

TEST_F(SweepTest, ZippedAxesStepTogetherInThePlaceOfTheFirst) {
  EXPECT_THAT(axes(plan("  axes:\n    scenario.camera.td_s: {linspace: [0, 0.02, 3]}\n"
                        "    scenario.camera.readout_s: [0.01, 0.03]\n    scenario.camera.pixel_sigma_px: [1, 2, 3]\n"
                        "  zip: [[scenario.camera.pixel_sigma_px, scenario.camera.td_s]]\n")),
              ElementsAre("0 0.01 1", "0 0.03 1", "0.01 0.01 2", "0.01 0.03 2", "0.02 0.01 3", "0.02 0.03 3"));
}

const std::string kSquare =
    "  axes: {scenario.camera.td_s: {linspace: [0, 0.1, 11]}, scenario.camera.readout_s: [0.01, 0.03]}\n";

TEST_F(SweepTest, FiltersLeaveOutAndKeep) {
  // A map's keys are joined by and, the maps and the values of a list by or. 0.03 is 0.030000000000000006 in the range.
  EXPECT_THAT(
      axes(plan(kSquare + "  only:\n    - {scenario.camera.td_s: [0.03, 0.1], scenario.camera.readout_s: 0.01}\n"
                          "    - {scenario.camera.td_s: 0.1}\n")),
      ElementsAre("0.030000000000000006 0.01", "0.1 0.01", "0.1 0.03"));
  EXPECT_THAT(axes(plan(kSquare + "  only: [{scenario.camera.td_s: [0, 0.1]}]\n"
                                  "  skip: [{scenario.camera.td_s: 0.1, scenario.camera.readout_s: 0.03}]\n")),
              ElementsAre("0 0.01", "0 0.03", "0.1 0.01"));
}

TEST_F(SweepTest, OnlyOfTheCommandLine) {
  EXPECT_THAT(axes(plan(kSquare, {}, {"scenario.camera.td_s=0.04", "scenario.camera.readout_s=0.01"})),
              ElementsAre("0.04 0.01"));
  EXPECT_THAT(axes(plan(kSquare, {}, {"scenario.camera.td_s=0", "scenario.camera.td_s=0.1"})),
              ElementsAre("0 0.01", "0 0.03", "0.1 0.01", "0.1 0.03"));
}

// So that results found once are found again, whatever was swept beside them.
TEST_F(SweepTest, ACellIsTheSameHoweverItWasWrittenDown) {
  const Plan alone = plan("  trials: 3\n", {"scenario.camera.td_s=0.02", "scenario.camera.readout_s=0.01"});
  ASSERT_EQ(alone.cells.size(), 1U);
  const std::string list = "  axes: {scenario.camera.td_s: [0, 0.02], scenario.camera.readout_s: [0.03, 0.01]}\n";
  const std::vector<Plan> others = {
      plan(list),
      plan("  axes: {scenario.camera.readout_s: [0.01, 0.03], scenario.camera.td_s: {linspace: [0, 0.04, 3]}}\n"),
      plan(list + "  zip: [[scenario.camera.td_s, scenario.camera.readout_s]]\n"),
      plan(list + "  skip: [{scenario.camera.td_s: 0}]\n"),
      plan(list, {}, {"scenario.camera.td_s=0.02"}),
      plan(list, {"scenario.camera.td_s=0.02"}),
  };
  for (const Plan& other : others) {
    int found = 0;
    for (const Cell& cell : other.cells) {
      if (cell.config_hash != alone.cells[0].config_hash) continue;
      ++found;
      EXPECT_EQ(run_id(cell, 2), run_id(alone.cells[0], 2));
    }
    EXPECT_EQ(found, 1);
  }
}

// A manifest is read with the limits of a configuration file.
TEST_F(SweepTest, TheManifestOfTheLargestSweepIsReadAgain) {
  const Plan largest = plan("  axes: {scenario.camera.td_s: {linspace: [0.01, 0.1, 1000]}}\n");
  const Plan again = read_manifest(write("manifest.json", to_manifest(largest).dump(2)));
  ASSERT_EQ(again.cells.size(), 1000U);
  EXPECT_EQ(again.config_hash, largest.config_hash);
  EXPECT_EQ(run_id(again.cells[777], 3), run_id(largest.cells[777], 3));
}

// A cell that the filters leave out is not checked, which may be why it is left out.
TEST_F(SweepTest, WhatIsLeftOutMayBeImpossible) {
  const std::string axis = "  axes: {scenario.camera.pixel_sigma_px: [1, -1]}\n";
  EXPECT_THAT(refusal(axis), HasSubstr("must be in [0, 100000], got -1"));
  EXPECT_THAT(axes(plan(axis + "  skip: [{scenario.camera.pixel_sigma_px: -1}]\n")), ElementsAre("1"));
}

TEST_F(SweepTest, AnOverrideReplacesAnAxisForTheFiltersToo) {
  const std::string filtered = kSquare + "  skip: [{scenario.camera.td_s: 0, scenario.camera.readout_s: 0.01}]\n";
  EXPECT_THAT(axes(plan(filtered, {"scenario.camera.td_s=0"})), ElementsAre("0.03"));
  EXPECT_THAT(axes(plan(filtered, {"scenario.camera.td_s=0.5"})), ElementsAre("0.01", "0.03"));
  const std::string zipped =
      "  axes: {scenario.camera.td_s: [0, 0.02], scenario.camera.readout_s: [0.01, 0.03]}\n"
      "  zip: [[scenario.camera.td_s, scenario.camera.readout_s]]\n";
  EXPECT_THAT(axes(plan(zipped, {"scenario.camera.td_s=0.01"})), ElementsAre("0.01", "0.03"));
  EXPECT_THAT(axes(plan(kSquare, {"experiment.axes={scenario.camera.pixel_sigma_px: [1, 2]}"})), ElementsAre("1", "2"));
}

TEST_F(SweepTest, MistakesAreNamedAtTheirPlace) {
  const auto axis = [](const std::string& value) { return "  axes:\n    scenario.camera.td_s: " + value + "\n"; };
  const std::string key = "x.yaml:4: experiment.axes.scenario.camera.td_s";
  EXPECT_THAT(refusal(axis("{linspce: [0, 1, 3]}")),
              HasSubstr(key + ".linspce: unknown key; did you mean 'linspace'?"));
  EXPECT_THAT(refusal(axis("{linspace: [0, 1]}")), HasSubstr(key + ": a range is"));
  EXPECT_THAT(refusal(axis("{}")), HasSubstr(key + ": a range is"));
  EXPECT_THAT(refusal(axis("{linspace: [0, 1, 3], logspace: [1, 2, 3]}")), HasSubstr(key + ": a range is"));
  EXPECT_THAT(refusal(axis("{linspace: [0, 1, 1]}")), HasSubstr(key + ": n must be a whole number from 2"));
  EXPECT_THAT(refusal(axis("{linspace: [0, 1, 2.5]}")), HasSubstr(key + ": n must be a whole number from 2"));
  EXPECT_THAT(refusal(axis("{logspace: [0, 1, 3]}")), HasSubstr(key + ".logspace[0]: must be > 0"));
  EXPECT_THAT(refusal(axis("[0, 0.0]")), HasSubstr("x.yaml:4: experiment.axes: the cell"));
  EXPECT_THAT(refusal("  axs: {}\n"), HasSubstr("x.yaml:3: experiment.axs: unknown key; did you mean 'axes'?"));
  EXPECT_THAT(refusal("  axes:\n    scenario.camera.td_s: {linspace: [0, 1, 1000]}\n"
                      "    scenario.camera.readout_s: {linspace: [0, 1, 1000]}\n"),
              HasSubstr("x.yaml:4: experiment.axes: more than 100000 cells before filters"));
  EXPECT_THAT(refusal("  axes: {scenario.camera.td_s: {linspace: [0, 0.1, 1001]}}\n"),
              HasSubstr("x.yaml:3: experiment.axes: 1001 cells; at most 1000"));
  EXPECT_THAT(refusal("  trials: 10000000\n  axes: {scenario.camera.td_s: {linspace: [0, 0.1, 300]}}\n"),
              HasSubstr("x.yaml:3: experiment.trials: must be <= 7158278 for 300 cells"));

  const std::string two = axis("[0, 0.02]") + "    scenario.camera.readout_s: [0.01, 0.02, 0.03]\n";
  EXPECT_THAT(
      refusal(two + "  zip: [[scenario.camera.td_s, scenario.camera.readout_s]]\n"),
      HasSubstr("x.yaml:6: experiment.zip: scenario.camera.td_s has 2 values, scenario.camera.readout_s has 3"));
  EXPECT_THAT(refusal(two + "  zip: [[scenario.camera.td_s, scenario.camera.readout]]\n"),
              HasSubstr("x.yaml:6: experiment.zip: 'scenario.camera.readout' is no axis; did you mean "
                        "'scenario.camera.readout_s'?"));
  EXPECT_THAT(refusal(two + "  zip: [[scenario.camera.td_s, scenario.camera.td_s]]\n"), HasSubstr("stands here twice"));
  EXPECT_THAT(refusal(two + "  zip: [scenario.camera.td_s]\n"),
              HasSubstr("x.yaml:6: experiment.zip: must be a list of"));
  EXPECT_THAT(refusal(two + "  skip: {scenario.camera.td_s: 0}\n"), HasSubstr("x.yaml:6: experiment.skip: must be a"));
  EXPECT_THAT(refusal(two + "  skip: [{scenario.camera.td: 0}]\n"),
              HasSubstr("x.yaml:6: experiment.skip.scenario.camera.td: 'scenario.camera.td' is no axis; did you mean "
                        "'scenario.camera.td_s'?"));
  EXPECT_THAT(
      refusal(two + "  only: [{scenario.camera.td_s: 0.01}]\n"),
      HasSubstr("x.yaml:6: experiment.only.scenario.camera.td_s: 0.01 is not among the axis' values, [0,0.02]"));
  EXPECT_THAT(refusal(two + "  skip: [{scenario.camera.td_s: [0, 0.02]}]\n"),
              HasSubstr("x.yaml:4: experiment.axes: the filters leave no cell"));
  EXPECT_EQ(refusal(two, {}, {"scenario.camera.td=0"}),
            "--only scenario.camera.td=0: 'scenario.camera.td' is no axis; did you mean 'scenario.camera.td_s'?");
  EXPECT_EQ(refusal(two, {}, {"scenario.camera.td_s=1"}),
            "--only scenario.camera.td_s=1: 1 is not among the axis' values, [0,0.02]");
  EXPECT_EQ(refusal(two, {}, {"scenario.camera.td_s"}), "--only scenario.camera.td_s: expects key=value");
}

}  // namespace
}  // namespace plumbline::tools
