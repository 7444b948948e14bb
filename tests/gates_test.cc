// Power and false alarms of a night's gates, on errors whose distribution is known.
#include "eval/gates.h"

#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/random.h"

namespace plumbline::eval {
namespace {

using ::testing::HasSubstr;

// An ATE is the length of an error of about six independent directions, td of one.
constexpr int kDirections = 6;

using Draw = std::function<double(std::uint64_t trial, std::uint64_t direction)>;

CellOutcomes outcomes(int trials, const Draw& draw, double factor = 1.0) {
  CellOutcomes cell;
  for (int t = 0; t < trials; ++t) {
    double squares = 0.0;
    for (std::uint64_t k = 0; k < kDirections; ++k) squares += std::pow(draw(static_cast<std::uint64_t>(t), k), 2);
    Row row;
    row.trial = t;
    row.seed = 1;
    row.ok = true;
    row.metrics = {{"ate_position_m", factor * std::sqrt(squares)},
                   {"td_error_s", factor * draw(static_cast<std::uint64_t>(t), kDirections)}};
    cell.add(row);
  }
  return cell;
}

// Errors of the same seeds in every night.
Draw of_seeds(const std::string& cell) {
  return [stream = core::RandomStream({1, 0}, cell)](std::uint64_t t, std::uint64_t k) { return stream.normal(t, k); };
}

// With an independent part of that standard deviation on top, another one each night.
Draw disturbed(const std::string& cell, double sigma, std::uint64_t night) {
  const core::RandomStream own({night, 0}, cell + "/own");
  return [base = of_seeds(cell), own, sigma](std::uint64_t t, std::uint64_t k) {
    return base(t, k) + sigma * own.normal(t, k);
  };
}

JudgedCell judged(const std::string& name, const CellOutcomes& baseline, const CellOutcomes& tonight) {
  return {.experiment = name, .tonight = tonight, .baseline = baseline, .fresh = {}, .baseline_fresh = {}};
}

std::vector<std::string> reds(const std::vector<Gate>& gates) {
  std::vector<std::string> names;
  for (const Gate& gate : gates) {
    if (gate.verdict == GateVerdict::kRed) names.push_back(gate.experiment + " " + gate.name);
  }
  return names;
}

TEST(Gates, AnIdenticalRebuildIsUnchangedWithoutATest) {
  const CellOutcomes cell = outcomes(50, of_seeds("a"));
  const std::vector<Gate> gates = judge_night({judged("a", cell, cell)}, {});
  ASSERT_EQ(gates.size(), 1U);
  EXPECT_EQ(gates[0].verdict, GateVerdict::kUnchanged);
  EXPECT_FALSE(gates[0].comparison.has_value());
  CellOutcomes one_bit = cell;
  one_bit.trials[7].values[0] = std::nextafter(one_bit.trials[7].values[0], 1e9);
  const std::vector<Gate> other = judge_night({judged("a", cell, one_bit)}, {});
  EXPECT_EQ(other.size(), 3U);  // failures and two metrics
  EXPECT_FALSE(is_red(other));
}

// More noise of the same seeds scales each error; 2 % of a metric at 50 seeds, among the tests of six cells.
TEST(Gates, TwoPerCentOfTheSameNoiseAreFoundInFiftySeeds) {
  std::vector<JudgedCell> cells;
  for (const char* name : {"a", "b", "c", "d", "e", "f"}) {
    const double factor = *name == 'c' ? 1.02 : 1.0;
    cells.push_back(
        judged(name, outcomes(50, disturbed(name, 0.01, 1)), outcomes(50, disturbed(name, 0.01, 2), factor)));
  }
  const std::vector<Gate> gates = judge_night(cells, {});
  EXPECT_THAT(reds(gates), ::testing::Contains("c ate_position_m"));
  for (const std::string& name : reds(gates)) EXPECT_TRUE(name.starts_with("c ")) << name;
  for (const Gate& gate : gates) {
    if (gate.verdict != GateVerdict::kRed) continue;
    EXPECT_THAT(gate.message, HasSubstr("RMSE"));
    EXPECT_THAT(gate.message, HasSubstr("baseline"));
    EXPECT_TRUE(gate.trial.has_value());
  }
}

// An error of 1/4 of the baseline's on top of it, independent, raises the RMSE by 3 %: sqrt(1 + 1/16) = 1.031.
TEST(Gates, ThreePerCentOfIndependentErrorNeedFourHundredSeeds) {
  const auto power = [](int trials) {
    int found = 0;
    for (std::uint64_t night = 1; night <= 40; ++night) {
      const std::vector<Gate> gates = judge_night(
          {judged("a", outcomes(trials, of_seeds("a")), outcomes(trials, disturbed("a", 0.25, night)))}, {});
      found += is_red(gates) ? 1 : 0;
    }
    return found;
  };
  EXPECT_LE(power(50), 16);
  EXPECT_GE(power(400), 34);
}

// 200 nights of three cells without a change: both sides are the seeds' errors with a tenth of fresh noise on top. At
// most alpha of them are red; more than 7 of 200 at 1 % would come once in a thousand suites.
TEST(Gates, NightsWithoutAChangeAreRedNoMoreThanStated) {
  for (const double alpha : {0.01, 0.1}) {
    int alarms = 0;
    for (std::uint64_t night = 1; night <= 200; ++night) {
      std::vector<JudgedCell> cells;
      for (const char* name : {"a", "b", "c"}) {
        cells.push_back(judged(name, outcomes(50, disturbed(name, 0.1, 2 * night)),
                               outcomes(50, disturbed(name, 0.1, 2 * night + 1))));
      }
      alarms += is_red(judge_night(cells, {.alpha = alpha, .practical_minimum = 0.0})) ? 1 : 0;
    }
    EXPECT_LE(alarms, alpha == 0.01 ? 7 : 34) << alpha;
    RecordProperty(alpha == 0.01 ? "alarms_of_200_at_1_percent" : "alarms_of_200_at_10_percent", alarms);
  }
}

TEST(Gates, LessThanThePracticalMinimumIsNoReason) {
  const CellOutcomes before = outcomes(50, of_seeds("a"));
  const CellOutcomes after = outcomes(50, of_seeds("a"), 1.005);
  EXPECT_FALSE(is_red(judge_night({judged("a", before, after)}, {})));
  EXPECT_TRUE(is_red(judge_night({judged("a", before, after)}, {.practical_minimum = 0.004})));
  const std::vector<Gate> better = judge_night({judged("a", before, outcomes(50, of_seeds("a"), 0.9))}, {});
  EXPECT_EQ(better[1].verdict, GateVerdict::kBetter);
  EXPECT_FALSE(is_red(better));
}

TEST(Gates, FailuresCountByMcNemar) {
  const CellOutcomes before = outcomes(50, of_seeds("a"));
  for (const int failures : {5, 12}) {
    CellOutcomes after = before;
    for (int i = 0; i < failures; ++i) {
      after.trials[static_cast<std::size_t>(3 * i)].ok = false;
      after.trials[static_cast<std::size_t>(3 * i)].values.clear();
    }
    const std::vector<Gate> gates = judge_night({judged("a", before, after)}, {});
    // Both-sided 2^(1-k) times three tests against 0.005: 12 new failures are enough, 5 are not.
    EXPECT_EQ(gates[0].verdict == GateVerdict::kRed, failures == 12);
    EXPECT_EQ(gates[0].trial, 0);
    EXPECT_FALSE(is_red(judge_night({judged("a", after, before)}, {})));  // fewer than before
  }
}

TEST(Gates, FreshSeedsTellOfAConsistencyThatIsLost) {
  const CellOutcomes cell = outcomes(10, of_seeds("a"));
  JudgedCell night = judged("a", cell, cell);
  const auto verdict = [&](double before, double now) {
    night.baseline_fresh = {{.name = "td_error_s", .dof = 1, .n = 10, .mean = before}};
    night.fresh = {{.name = "td_error_s", .dof = 1, .n = 10, .mean = now}};
    return judge_night({night}, {}).back().verdict;
  };
  EXPECT_EQ(verdict(1.0, 1.2), GateVerdict::kGreen);
  EXPECT_EQ(verdict(1.0, 4.0), GateVerdict::kRed);          // chi2inv(0.9975, 10) / 10 = 2.7
  EXPECT_EQ(verdict(4.0, 4.0), GateVerdict::kNotCompared);  // it never was
  EXPECT_EQ(verdict(4.0, 1.0), GateVerdict::kGreen);
}

TEST(Gates, WithoutABaselineNothingIsRed) {
  const std::vector<Gate> gates = judge_night({{.experiment = "a",
                                                .tonight = outcomes(10, of_seeds("a")),
                                                .baseline = std::nullopt,
                                                .fresh = {},
                                                .baseline_fresh = {}}},
                                              {});
  ASSERT_EQ(gates.size(), 1U);
  EXPECT_EQ(gates[0].verdict, GateVerdict::kNotCompared);
}

}  // namespace
}  // namespace plumbline::eval
