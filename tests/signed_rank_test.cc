#include "eval/signed_rank.h"

#include <cmath>
#include <limits>
#include <stdexcept>
#include <vector>

#include <gtest/gtest.h>

#include "core/random.h"
#include "eval/multiple_tests.h"

namespace plumbline::eval {
namespace {

// All 2^n signs of the ranks, one by one.
double brute_force_p(const std::vector<double>& d) {
  std::vector<double> magnitude;
  std::vector<bool> positive;
  for (const double x : d) {
    if (x == 0.0) continue;
    magnitude.push_back(std::abs(x));
    positive.push_back(x > 0.0);
  }
  const std::size_t n = magnitude.size();
  std::vector<double> ranks(n);
  double observed = 0.0;
  double all = 0.0;
  for (std::size_t i = 0; i < n; ++i) {
    int below = 0;
    int equal = 0;
    for (std::size_t j = 0; j < n; ++j) {
      below += magnitude[j] < magnitude[i] ? 1 : 0;
      equal += magnitude[j] == magnitude[i] ? 1 : 0;
    }
    ranks[i] = below + 0.5 * (equal + 1);
    all += ranks[i];
    if (positive[i]) observed += ranks[i];
  }
  int extreme = 0;
  for (unsigned signs = 0; signs < (1U << n); ++signs) {
    double sum = 0.0;
    for (std::size_t i = 0; i < n; ++i) sum += (signs >> i & 1U) != 0U ? ranks[i] : 0.0;
    extreme += std::min(sum, all - sum) <= std::min(observed, all - observed) ? 1 : 0;
  }
  return extreme / static_cast<double>(1U << n);
}

TEST(SignedRank, ExactPValuesCountAllSigns) {
  for (const std::vector<double>& d :
       {std::vector<double>{1.1, -0.3, 2.2, 0.7, 0.9, -0.1, 1.4, 3.0},
        std::vector<double>{1, 1, -1, 2, 2, 3, -3, 5, 5, 5}, std::vector<double>{0, 0, 1, -2, 3, 4, 4},
        std::vector<double>{-1, -2, -3, -4, -5, -6}}) {
    EXPECT_NEAR(signed_rank_p_value(d), brute_force_p(d), 1e-14);
  }
  EXPECT_DOUBLE_EQ(signed_rank_p_value({1, 2, 3, 4, 5, 6}), 2.0 / 64.0);
  EXPECT_EQ(signed_rank_p_value({0.0, 0.0}), 1.0);
  EXPECT_EQ(signed_rank_p_value({}), 1.0);
}

// On either side of the switch the p values belong to the same test: the normal one is within 2 % of the exact one
// where it matters (the error of the approximation at n = 50 is of order 1/n).
TEST(SignedRank, NormalApproximationContinuesTheExactTest) {
  std::vector<double> d;
  for (int i = 1; i <= kExactPairs; ++i) d.push_back(i % 3 == 0 ? -i : i);
  const double exact = signed_rank_p_value(d);
  EXPECT_GT(exact, 0.01);
  EXPECT_LT(exact, 0.1);
  d.push_back(1e-9);  // rank 1: as good as no further pair
  EXPECT_NEAR(signed_rank_p_value(d) / exact, 1.0, 0.1);
  // Ties take variance away: scipy.stats.wilcoxon([1] * 40 + [-1] * 20, correction=True).pvalue
  std::vector<double> tied(40, 1.0);
  tied.insert(tied.end(), 20, -1.0);
  const double mean = 60 * 61 / 4.0;
  const double variance = 60 * 61 * 121 / 24.0 - (60.0 * 60 * 60 - 60) / 48.0;
  EXPECT_NEAR(signed_rank_p_value(tied), std::erfc((40 * 30.5 - mean - 0.5) / std::sqrt(2.0 * variance)), 1e-12);
}

TEST(SignedRank, HodgesLehmannIsTheMedianOfTheWalshAverages) {
  EXPECT_DOUBLE_EQ(hodges_lehmann({1.0}), 1.0);
  EXPECT_DOUBLE_EQ(hodges_lehmann({1.0, 3.0}), 2.0);       // 1, 2, 3
  EXPECT_DOUBLE_EQ(hodges_lehmann({1.0, 3.0, 9.0}), 4.0);  // 1, 2, 3, 5, 6, 9
  EXPECT_DOUBLE_EQ(hodges_lehmann({0.0, 0.0, 0.0, -5.0}), 0.0);
  EXPECT_DOUBLE_EQ(hodges_lehmann({-2.0, 5.0, 1.0, 7.0}), 2.75);  // -2 -.5 1 1.5 2.5 | 3 4 5 6 7
  EXPECT_THROW(hodges_lehmann({}), std::invalid_argument);
  EXPECT_THROW(hodges_lehmann({std::numeric_limits<double>::infinity()}), std::invalid_argument);
}

TEST(SignedRank, IntervalIsWhatTheTestDoesNotReject) {
  const core::RandomStream stream({3, 0}, "test");
  for (const int n : {6, 9, 17, 40}) {
    std::vector<double> d;
    for (int i = 0; i < n; ++i) d.push_back(0.3 + stream.normal(static_cast<std::uint64_t>(i)));
    const Interval interval = hodges_lehmann_interval(d, 0.95).value_or(Interval{});
    EXPECT_TRUE(interval.contains(hodges_lehmann(d)));
    const auto p_about = [&](double location) {
      std::vector<double> moved = d;
      for (double& x : moved) x -= location;
      return signed_rank_p_value(moved);
    };
    EXPECT_GT(p_about(interval.lo + 1e-9), 0.05) << n;
    EXPECT_LE(p_about(interval.lo - 1e-9), 0.05) << n;
    EXPECT_GT(p_about(interval.hi - 1e-9), 0.05) << n;
    EXPECT_LE(p_about(interval.hi + 1e-9), 0.05) << n;
  }
  EXPECT_FALSE(hodges_lehmann_interval({1, 2, 3, 4, 5}, 0.95).has_value());
}

// At the stated shift the test finds it in four of five repetitions: 2,000 of them, 3 sigma of the binomial are 2.7 %.
TEST(SignedRank, PowerIsAsStated) {
  const core::RandomStream stream({4, 0}, "test");
  for (const int n : {10, 20, 50}) {
    const double shift = smallest_detectable_shift(1.0, n, 0.05, 0.8).value_or(0.0);
    int found = 0;
    for (std::uint64_t repetition = 0; repetition < 2000; ++repetition) {
      std::vector<double> d;
      const auto first = 100 * static_cast<std::uint64_t>(n);
      for (int i = 0; i < n; ++i) {
        d.push_back(shift + stream.normal(first + static_cast<std::uint64_t>(i), repetition));
      }
      found += signed_rank_p_value(d) <= 0.05 ? 1 : 0;
    }
    EXPECT_NEAR(found / 2000.0, 0.8, 0.03) << n;
  }
  EXPECT_FALSE(smallest_detectable_shift(1.0, 5, 0.05, 0.8).has_value());
}

TEST(MultipleTests, McNemarByHand) {
  EXPECT_EQ(mcnemar_p_value(0, 0), 1.0);
  EXPECT_EQ(mcnemar_p_value(3, 3), 1.0);
  EXPECT_NEAR(mcnemar_p_value(0, 6), 2.0 / 64.0, 1e-15);
  EXPECT_NEAR(mcnemar_p_value(9, 1), 2.0 * 11.0 / 1024.0, 1e-15);
  EXPECT_EQ(mcnemar_p_value(9, 1), mcnemar_p_value(1, 9));
  EXPECT_THROW(mcnemar_p_value(-1, 0), std::invalid_argument);
}

TEST(MultipleTests, HolmByHand) {
  const std::vector<double> adjusted = holm({0.01, 0.04, 0.03, 0.005});
  const std::vector<double> expected = {0.03, 0.06, 0.06, 0.02};
  for (std::size_t i = 0; i < expected.size(); ++i) EXPECT_NEAR(adjusted[i], expected[i], 1e-15) << i;
  EXPECT_EQ(holm({0.9, 0.8}), (std::vector<double>{1.0, 1.0}));
  EXPECT_TRUE(holm({}).empty());
}

}  // namespace
}  // namespace plumbline::eval
