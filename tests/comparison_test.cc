#include "eval/comparison.h"

#include <cmath>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "core/random.h"

namespace plumbline::eval {
namespace {

using ::testing::HasSubstr;

constexpr int kTrials = 20;

// Two metrics a trial: the noise of a trial is shared by all variants, what a variant adds is its own.
std::vector<CellOutcomes> variant(double factor, const std::string& name, int trials = kTrials) {
  const core::RandomStream shared({1, 0}, "shared");
  const core::RandomStream own({1, 0}, name);
  std::vector<CellOutcomes> cells;
  for (int c = 0; c < 2; ++c) {
    CellOutcomes& cell = cells.emplace_back();
    cell.axes = {{"scenario.camera.td_s", 0.01 * c}};
    for (int t = 0; t < trials; ++t) {
      const auto index = 100 * static_cast<std::uint64_t>(c) + static_cast<std::uint64_t>(t);
      Row row;
      row.cell = c;
      row.trial = t;
      row.seed = 7;
      row.ok = true;
      const double ate = 0.01 * std::exp(shared.normal(index) + 0.05 * own.normal(index)) * factor;
      const double td = 1e-5 * shared.normal(index, 1) * std::exp(0.05 * own.normal(index, 1));
      // kappa2 is no error, whichever way it moves.
      row.metrics = {{"ate_position_m", ate}, {"td_error_s", td}, {std::string(kKappa2), 0.01 * factor}};
      cell.add(row);
    }
  }
  return cells;
}

std::string message(const std::vector<CellOutcomes>& a, const std::vector<CellOutcomes>& b,
                    const std::vector<std::string>& metrics = {}) {
  try {
    compare(a, b, metrics);
  } catch (const core::DataError& error) {
    return error.what();
  }
  return "none";
}

TEST(Comparison, FindsAFewPerCentInPairsThatVaryByAFactor) {
  const Comparison worse = compare(variant(1.0, "a"), variant(1.1, "b"));
  EXPECT_TRUE(worse.worse);
  EXPECT_EQ(worse.tests, 6);  // two metrics and the failures, two cells
  for (const CellComparison& cell : worse.cells) {
    const MetricComparison& ate = cell.metrics[0];
    EXPECT_EQ(ate.pairs, kTrials);
    EXPECT_NEAR(ate.ratio, 1.1, 0.055);  // three standard errors, 1.1 * 0.05 sqrt(2 / 20)
    EXPECT_GT(ate.ratio_ci95.value_or(Interval{}).lo, 1.0);
    EXPECT_LT(ate.p_holm, 0.01);
    EXPECT_GE(ate.p_holm, ate.p);
    EXPECT_GT(cell.metrics[1].p_holm, 0.05);
    // sd of ln ratio 0.05 sqrt(2), n = 20, level 0.05 / 6: (3.0 + 0.86) 0.071 sqrt(1.047 / 20) = 0.063
    EXPECT_NEAR(std::log(ate.detectable_ratio.value_or(0.0)), 0.063, 0.02);
  }
  EXPECT_FALSE(compare(variant(1.1, "b"), variant(1.0, "a")).worse);  // better is not worse
}

TEST(Comparison, TheSameIsNotWorse) {
  const Comparison same = compare(variant(1.0, "a"), variant(1.0, "a"));
  EXPECT_FALSE(same.worse);
  EXPECT_EQ(same.cells[0].metrics[0].ratio, 1.0);
  EXPECT_EQ(same.cells[0].metrics[0].p, 1.0);
}

// Over 200 pairs of equal variants, each of two cells by two metrics, false alarms (either way) stay at alpha: 10
// expected, and 23 are 4.2 standard deviations above.
TEST(Comparison, FalseAlarmsAreRare) {
  int alarms = 0;
  for (int k = 0; k < 200; ++k) {
    const Comparison c = compare(variant(1.0, fmt::format("a{}", k)), variant(1.0, fmt::format("b{}", k)));
    bool alarm = false;
    for (const CellComparison& cell : c.cells) {
      for (const MetricComparison& m : cell.metrics) alarm = alarm || m.p_holm <= c.alpha;
    }
    alarms += alarm ? 1 : 0;
  }
  EXPECT_LE(alarms, 23);
  EXPECT_GE(alarms, 1);
}

TEST(Comparison, FailuresAreComparedOnTheirOwn) {
  std::vector<CellOutcomes> b = variant(0.5, "b");  // better where it works
  for (int t = 0; t < 12; ++t) {
    b[1].trials[static_cast<std::size_t>(t)].ok = false;
    b[1].trials[static_cast<std::size_t>(t)].values.clear();
  }
  const Comparison c = compare(variant(1.0, "a"), b);
  EXPECT_TRUE(c.worse);
  EXPECT_EQ(c.cells[1].n_ok_b, 8);
  EXPECT_EQ(c.cells[1].only_b_failed, 12);
  EXPECT_EQ(c.cells[1].metrics[0].pairs, 8);
  EXPECT_NEAR(c.cells[1].p_failures, 2.0 / 4096.0, 1e-12);
  EXPECT_FALSE(compare(b, variant(1.0, "a"), {"td_error_s"}).worse);
}

TEST(Comparison, WhatCannotBeComparedSaysWhy) {
  std::vector<CellOutcomes> b = variant(1.0, "b");
  b[0].trials[3].values[1] = 0.0;
  const Comparison c = compare(variant(1.0, "a"), b);
  EXPECT_THAT(c.cells[0].metrics[1].not_compared, HasSubstr("exactly 0"));
  EXPECT_EQ(c.tests, 5);
  const auto json = to_json(c);
  EXPECT_FALSE(json["cells"][0]["metrics"]["td_error_s"].contains("p"));
  EXPECT_TRUE(json["cells"][1]["metrics"]["td_error_s"].contains("p_holm"));
  EXPECT_THAT(comparison_table(c), HasSubstr("exactly 0"));
}

TEST(Comparison, RefusesWhatDoesNotMatch) {
  const std::vector<CellOutcomes> a = variant(1.0, "a");
  EXPECT_EQ(message(a, variant(1.0, "b")), "none");
  EXPECT_THAT(message(a, variant(1.0, "b", 19)), HasSubstr("B has no trial 19 of seed 7"));
  EXPECT_THAT(message(variant(1.0, "b", 19), a), HasSubstr("A has no trial 19 of seed 7"));
  std::vector<CellOutcomes> b = a;
  b.pop_back();
  EXPECT_THAT(message(a, b), HasSubstr("B has no cell"));
  EXPECT_THAT(message(b, a), HasSubstr("A has no cell"));
  b = a;
  b[0].trials[0].seed = 8;
  EXPECT_THAT(message(a, b), HasSubstr("seed"));
  b = a;
  b[0].trials.push_back(b[0].trials[0]);
  EXPECT_THAT(message(a, b), HasSubstr("twice"));
  EXPECT_THAT(message(a, a, {"speed"}), HasSubstr("'speed'"));
}

}  // namespace
}  // namespace plumbline::eval
