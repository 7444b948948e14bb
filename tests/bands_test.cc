#include "eval/bands.h"

#include <cmath>
#include <stdexcept>
#include <vector>

#include <gtest/gtest.h>

#include "eval/statistics.h"

namespace plumbline::eval {
namespace {

TEST(Bands, AreTheQuantilesOfEachInstant) {
  BandOverTrials bands;
  std::vector<double> first;
  for (int trial = 0; trial < 21; ++trial) {
    bands.add({0.0, 1.0}, {1.0 * trial, -2.0 * trial});
    first.push_back(trial);
  }
  const Band band = bands.band();
  ASSERT_EQ(band.t_s, (std::vector<double>{0.0, 1.0}));
  EXPECT_EQ(band.n, (std::vector<int>{21, 21}));
  EXPECT_DOUBLE_EQ(band.q05[0], 1.0);
  EXPECT_DOUBLE_EQ(band.median[0], 10.0);
  EXPECT_DOUBLE_EQ(band.q95[0], 19.0);
  EXPECT_DOUBLE_EQ(band.rms[0], root_mean_square(first));
  EXPECT_DOUBLE_EQ(band.q05[1], -38.0);
  EXPECT_DOUBLE_EQ(band.mean[1], -20.0);
}

// A trial that began later, with instants a little aside; one beyond the end is no instant of the first.
TEST(Bands, GiveValuesToTheNearestInstant) {
  BandOverTrials bands;
  bands.add({0.0, 1.0, 2.0}, {1.0, 2.0, 3.0});
  bands.add({0.9, 2.2, 2.6}, {4.0, 5.0, 100.0});
  const Band band = bands.band();
  EXPECT_EQ(band.n, (std::vector<int>{1, 2, 2}));
  EXPECT_EQ(band.mean, (std::vector<double>{1.0, 3.0, 4.0}));
  EXPECT_THROW(bands.add({0.0}, {}), std::invalid_argument);
}

TEST(Bands, OfNothingAreEmpty) { EXPECT_TRUE(BandOverTrials().band().t_s.empty()); }

}  // namespace
}  // namespace plumbline::eval
