// Factors of a trajectory spline: the laws of tests/factor_laws.h, and what is particular to segments.
#include <cmath>

#include <gtest/gtest.h>

#include "factor_laws.h"
#include "spline_subjects.h"

namespace plumbline::testing {
INSTANTIATE_TEST_SUITE_P(Splines, FactorLaws, ::testing::ValuesIn(spline_subjects()), subject_name);
INSTANTIATE_TEST_SUITE_P(Splines, WorldFrameLaws, ::testing::ValuesIn(in_world(spline_subjects())), subject_name);
}  // namespace plumbline::testing

namespace plumbline::estimator {
namespace {

using testing::kSplineIntervalS;

TEST(SplineBasis, EqualsTheRecursionOfDeBoorAndCox) {
  for (int order = core::bspline::kLeastOrder; order <= core::bspline::kMostOrder; ++order) {
    for (const double u : {0.0, 0.3, 1.0, 1.4, -0.2}) {
      const core::bspline::Weights w = core::bspline::weights(order, u, kSplineIntervalS);
      for (int derivative = 0; derivative < std::min(3, order - 1); ++derivative) {
        const auto d = static_cast<std::size_t>(derivative);
        const std::vector<double> b = testing::plain_basis(order, u, derivative);
        double cumulative = 0.0;
        for (int j = core::bspline::kMostOrder - 1; j >= 0; --j) {
          const double expected =
              j < order ? b[static_cast<std::size_t>(j)] / std::pow(kSplineIntervalS, derivative) : 0.0;
          cumulative += expected;
          EXPECT_NEAR(w.plain[d][j], expected, 1e-11) << order << ' ' << u << ' ' << derivative;
          EXPECT_NEAR(w.cumulative[d][j], cumulative, 1e-11) << order << ' ' << u << ' ' << derivative;
        }
      }
    }
  }
}

// omega and acceleration are derivatives of the pose that the same path gives.
TEST(SplinePath, RatesAreThoseOfItsPoses) {
  constexpr double kStepS = 1e-4;  // differences are good to its square times third derivatives of 1e2
  for (const int order : {4, 5, 6}) {
    const SplineKnots knots = testing::scene_knots(order);
    std::vector<PoseBlock> controls;
    for (const core::Pose& T : testing::scene_controls(3)) controls.push_back(pack(T));
    std::vector<const double*> blocks;
    for (int j = 0; j < order; ++j) blocks.push_back(controls[static_cast<std::size_t>(4 + j)].data());
    SplinePath path(knots, 4, blocks.data());
    TimedBody before;
    TimedBody at;
    TimedBody after;
    ASSERT_TRUE(path.at(0.437 - kStepS, before) && path.at(0.437 + kStepS, after) && path.at(0.437, at));
    const Eigen::Quaterniond turn(before.R.transpose() * after.R);
    EXPECT_LT((core::log_so3(turn) / (2.0 * kStepS) - at.omega).norm(), 1e-5) << order;
    EXPECT_LT(((after.p - before.p) / (2.0 * kStepS) - at.velocity).norm(), 1e-5) << order;
    EXPECT_LT(((after.velocity - before.velocity) / (2.0 * kStepS) - path.acceleration()).norm(), 1e-4) << order;
  }
}

// A little outside of its segment a path is the spline but for the jump of the last derivative: to the order - 1.
TEST(SplinePath, GoesOnBeyondItsSegment) {
  std::vector<PoseBlock> controls;
  for (const core::Pose& T : testing::scene_controls(5)) controls.push_back(pack(T));
  const auto at = [&](int segment, double t_s) {
    std::vector<const double*> blocks;
    for (int j = 0; j < 6; ++j) blocks.push_back(controls[static_cast<std::size_t>(segment + j)].data());
    TimedBody body;
    EXPECT_TRUE(SplinePath(testing::scene_knots(), segment, blocks.data()).at(t_s, body));
    return body;
  };
  const auto error = [&](double overshoot) {
    const double t_s = (5.0 + overshoot) * kSplineIntervalS;
    return (at(4, t_s).p - at(5, t_s).p).norm();
  };
  EXPECT_NEAR(error(0.2) / error(0.1), 32.0, 1.0);
  EXPECT_LT(error(0.01), 1e-11);
  EXPECT_LT((at(4, 0.51).R - at(5, 0.51).R).norm(), 1e-5);
}

TEST(SplinePath, EndsAnIntervalBeyondItsSegment) {
  std::vector<PoseBlock> controls;
  for (const core::Pose& T : testing::scene_controls(5)) controls.push_back(pack(T));
  std::vector<const double*> blocks;
  for (const PoseBlock& c : controls) blocks.push_back(c.data());
  SplinePath path(testing::scene_knots(), 0, blocks.data());
  TimedBody body;
  EXPECT_TRUE(path.at(1.9 * kSplineIntervalS, body));
  EXPECT_FALSE(path.at(2.1 * kSplineIntervalS, body));
  EXPECT_FALSE(path.at(-1.1 * kSplineIntervalS, body));
}

TEST(SegmentPair, HasEachControlOnce) {
  const SplineKnots knots = testing::scene_knots();
  EXPECT_EQ(SegmentPair(knots, {3, 3}).size, 6);
  EXPECT_EQ(SegmentPair(knots, {3, 5}).controls(), (std::vector<int>{3, 4, 5, 6, 7, 8, 9, 10}));
  EXPECT_EQ(SegmentPair(knots, {5, 3}).controls(), (std::vector<int>{3, 4, 5, 6, 7, 8, 9, 10}));
  EXPECT_EQ(SegmentPair(knots, {3, 12}).size, 12);
  EXPECT_EQ(SegmentPair(knots, {12, 3}).controls().back(), 17);
}

}  // namespace
}  // namespace plumbline::estimator
