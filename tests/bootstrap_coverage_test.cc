// The bootstrap's 95 % interval covers the RMSE of trajectory errors in 93 to 97 % of 2,000 repetitions at the smallest
// n at which it is used; four standard deviations of the binomial are 2 %.
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "core/random.h"
#include "eval/bootstrap.h"

namespace plumbline::eval {
namespace {

TEST(BootstrapCoverage, OfTrajectoryErrors) {
  constexpr int kRepetitions = 2000;
  const core::RandomStream stream({21, 0}, "trajectory");
  int covered = 0;
  for (std::uint64_t repetition = 0; repetition < kRepetitions; ++repetition) {
    std::vector<double> values;
    for (std::uint64_t i = 0; i < kBootstrapTrials; ++i) {
      const auto z = stream.normals(i, repetition);
      values.push_back(std::sqrt(z[0] * z[0] + 0.5 * z[1] * z[1] + 0.25 * z[2] * z[2] + 0.25 * z[3] * z[3]));
    }
    covered += bca_interval(values, root_mean_square, 0.95, repetition).contains(std::sqrt(2.0)) ? 1 : 0;
  }
  EXPECT_GE(covered, 0.93 * kRepetitions);
  EXPECT_LE(covered, 0.97 * kRepetitions);
}

}  // namespace
}  // namespace plumbline::eval
