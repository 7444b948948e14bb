#include "eval/verdict.h"

#include <cmath>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/random.h"

namespace plumbline::eval {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;

// `n` trials of an estimator that states `scale` times its true variance; the first `failed` fail.
CellSummary cell(int n, double scale, int failed, std::uint64_t seed = 1) {
  const core::RandomStream stream({seed, 0}, "verdict");
  std::vector<Row> rows;
  for (int t = 0; t < n; ++t) {
    Row row;
    row.trial = t;
    row.ok = t >= failed;
    const double e = stream.normal(static_cast<std::uint64_t>(t));
    if (row.ok) row.metrics = {{"td_error_s", 1e-5 * e, e * e / scale, 1, 1e-5}};
    rows.push_back(row);
  }
  return summarise(rows, {});
}

TEST(Verdict, IsOkForAConsistentEstimator) {
  const Verdict verdict = judge({cell(50, 1.0, 0)}, 0.0);
  EXPECT_EQ(verdict.level, VerdictLevel::kOk);
  EXPECT_THAT(verdict.findings, Contains("50 of 50 trials gave an answer."));
  EXPECT_THAT(verdict.findings, Contains(HasSubstr("td error: RMSE ")));
  EXPECT_THAT(verdict.findings, Contains(HasSubstr("times the Cramer-Rao bound")));
}

TEST(Verdict, SeesACovarianceThatIsFourTimesOff) {
  for (const double scale : {0.25, 4.0}) {
    const Verdict verdict = judge({cell(50, scale, 0)}, 0.0);
    EXPECT_EQ(verdict.level, VerdictLevel::kAttention) << scale;
    EXPECT_THAT(verdict.headline, HasSubstr("covariance does not fit"));
  }
}

// One in twenty of the 95 % bands is missed; the verdict of 20 cells at once must not be moved by that. At 1 % a sweep,
// more than 4 of 100 consistent ones would come once in 300.
TEST(Verdict, IsNotMovedByChance) {
  int attention = 0;
  for (std::uint64_t sweep = 0; sweep < 100; ++sweep) {
    std::vector<CellSummary> cells;
    for (std::uint64_t c = 0; c < 20; ++c) cells.push_back(cell(20, 1.0, 0, 1 + 100 * sweep + c));
    attention += judge(cells, 0.0).level == VerdictLevel::kOk ? 0 : 1;
  }
  EXPECT_LE(attention, 4);
}

TEST(Verdict, CountsFailures) {
  EXPECT_EQ(judge({cell(50, 1.0, 1)}, 0.0).level, VerdictLevel::kFailed);
  const Verdict allowed = judge({cell(50, 1.0, 1)}, 0.02);
  EXPECT_EQ(allowed.level, VerdictLevel::kAttention);
  EXPECT_THAT(allowed.findings, Contains(HasSubstr("Consistency is not claimed")));
  EXPECT_EQ(judge({cell(3, 1.0, 3)}, 1.0).level, VerdictLevel::kFailed);  // no answer at all
}

}  // namespace
}  // namespace plumbline::eval
