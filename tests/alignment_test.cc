#include "eval/alignment.h"

#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <vector>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

namespace plumbline::eval {
namespace {

using Points = std::vector<Eigen::Vector3d>;

// Centred, of equal spread along the axes: what alignment does to it can be worked out by hand.
const Points kOctahedron = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};

Eigen::Matrix3d turn(double degrees, const Eigen::Vector3d& axis) {
  return Eigen::AngleAxisd(degrees * std::numbers::pi / 180.0, axis.normalized()).toRotationMatrix();
}

Points mapped(const Points& points, double s, const Eigen::Matrix3d& R, const Eigen::Vector3d& t) {
  Points result;
  for (const auto& x : points) result.push_back(s * (R * x) + t);
  return result;
}

// A wavy path without symmetry.
Points path(int n) {
  Points points;
  for (int k = 0; k < n; ++k) {
    const double u = 0.1 * k;
    points.emplace_back(3.0 * std::cos(u), 2.0 * std::sin(1.3 * u) + u, 0.5 * std::sin(2.0 * u));
  }
  return points;
}

Similarity aligned(const Points& estimate, const Points& truth, Alignment alignment, int first_n = 0) {
  const AlignmentResult result = align(estimate, truth, alignment, first_n);
  EXPECT_TRUE(result.ok) << result.reason;
  return result.truth_from_estimate;
}

TEST(Alignment, RecoversTheTransformFromEstimateToTruth) {
  const Points estimate = path(40);
  const Eigen::Vector3d t(1.0, -2.0, 3.0);
  struct Case {
    Alignment alignment;
    double s;
    Eigen::Matrix3d R;
  };
  for (const Case& c :
       {Case{Alignment::kPosyaw, 1.0, turn(130.0, Eigen::Vector3d::UnitZ())},
        Case{Alignment::kSe3, 1.0, turn(-70.0, {1, 2, 3})}, Case{Alignment::kSim3, 0.25, turn(170.0, {-1, 0.5, 1})}}) {
    const Similarity S = aligned(estimate, mapped(estimate, c.s, c.R, t), c.alignment);
    EXPECT_NEAR(S.s, c.s, 1e-12);
    EXPECT_LT((S.R - c.R).norm(), 1e-12);
    EXPECT_LT((S.t - t).norm(), 1e-12);
  }
}

TEST(Alignment, NoneLeavesEverything) {
  const Similarity S = aligned(path(5), mapped(path(5), 2.0, turn(30, {0, 0, 1}), {1, 1, 1}), Alignment::kNone);
  EXPECT_EQ(S.s, 1.0);
  EXPECT_EQ(S.R, Eigen::Matrix3d::Identity());
  EXPECT_EQ(S.t, Eigen::Vector3d::Zero());
}

TEST(Alignment, OnlySim3TouchesScale) {
  const Points truth = path(40);
  const Points estimate = mapped(truth, 1.1, Eigen::Matrix3d::Identity(), Eigen::Vector3d::Zero());
  EXPECT_EQ(aligned(estimate, truth, Alignment::kPosyaw).s, 1.0);
  EXPECT_EQ(aligned(estimate, truth, Alignment::kSe3).s, 1.0);
  EXPECT_NEAR(aligned(estimate, truth, Alignment::kSim3).s, 1.0 / 1.1, 1e-12);
}

// Stretched along x by 1.2: no rotation helps, and s = tr(C) / variance = (2 * 1.2 + 4) / (2 * 1.44 + 4).
TEST(Alignment, HandDerivedScale) {
  Points estimate = kOctahedron;
  for (auto& x : estimate) x.x() *= 1.2;
  EXPECT_LT((aligned(estimate, kOctahedron, Alignment::kSe3).R - Eigen::Matrix3d::Identity()).norm(), 1e-12);
  EXPECT_NEAR(aligned(estimate, kOctahedron, Alignment::kSim3).s, 6.4 / 6.88, 1e-14);
}

TEST(Alignment, PosyawLeavesTilt) {
  const Points tilted = mapped(kOctahedron, 1.0, turn(10.0, Eigen::Vector3d::UnitX()), Eigen::Vector3d::Zero());
  EXPECT_LT((aligned(tilted, kOctahedron, Alignment::kPosyaw).R - Eigen::Matrix3d::Identity()).norm(), 1e-12);
  EXPECT_LT((aligned(tilted, kOctahedron, Alignment::kSe3).R - turn(-10.0, Eigen::Vector3d::UnitX())).norm(), 1e-12);
}

TEST(Alignment, NeverReflects) {
  Points mirrored = path(40);
  for (auto& x : mirrored) x.z() = -x.z();
  for (const Alignment alignment : {Alignment::kSe3, Alignment::kSim3}) {
    EXPECT_NEAR(aligned(mirrored, path(40), alignment).R.determinant(), 1.0, 1e-12);
  }
}

TEST(Alignment, FirstPosesAloneDecide) {
  const Points truth = path(40);
  const Eigen::Matrix3d R = turn(25.0, Eigen::Vector3d::UnitZ());
  Points estimate = mapped(truth, 1.0, R.transpose(), Eigen::Vector3d::Zero());
  for (std::size_t k = 10; k < estimate.size(); ++k) estimate[k] *= 3.0;
  EXPECT_LT((aligned(estimate, truth, Alignment::kPosyaw, 10).R - R).norm(), 1e-12);
  EXPECT_GT((aligned(estimate, truth, Alignment::kPosyaw).t).norm(), 0.1);
  EXPECT_LT(
      (aligned(estimate, truth, Alignment::kPosyaw, 1000).t - aligned(estimate, truth, Alignment::kPosyaw).t).norm(),
      1e-12);
}

TEST(Alignment, RefusesWhatDoesNotDetermineIt) {
  const Points line = {{0, 0, 0}, {1, 2, 3}, {2, 4, 6}, {3, 6, 9}};
  const Points rest(5, Eigen::Vector3d(0.1, 0.2, 0.3));
  for (const Alignment alignment : {Alignment::kSe3, Alignment::kSim3}) {
    EXPECT_FALSE(align(path(2), path(2), alignment).ok);
    EXPECT_FALSE(align(path(9), path(9), alignment, 2).ok);
    EXPECT_FALSE(align(line, line, alignment).ok);
    EXPECT_FALSE(align(rest, rest, alignment).ok);
    EXPECT_FALSE(align(path(5), rest, alignment).ok);
  }
  EXPECT_FALSE(align(path(9), path(9), Alignment::kPosyaw, 1).ok);
  EXPECT_EQ(align(rest, rest, Alignment::kSim3).reason, "sim3 alignment is not determined: the positions do not move");
  EXPECT_EQ(align(line, line, Alignment::kSe3).reason, "se3 alignment is not determined: the positions lie on a line");
  Points gap = path(9);
  gap[4].y() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(align(gap, path(9), Alignment::kPosyaw).reason, "the positions are not finite");
  EXPECT_THROW(align(path(3), path(4), Alignment::kNone), std::invalid_argument);
  EXPECT_THROW(align(path(3), path(3), Alignment::kNone, -1), std::invalid_argument);
}

TEST(Alignment, PosyawOfARigAtRestOnlyShifts) {
  const Points rest(5, Eigen::Vector3d(0.1, 0.2, 0.3));
  const Similarity S = aligned(path(5), rest, Alignment::kPosyaw);
  EXPECT_EQ(S.R, Eigen::Matrix3d::Identity());
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const auto& x : path(5)) mean += x / 5.0;
  EXPECT_LT((S * mean - rest[0]).norm(), 1e-15);
}

}  // namespace
}  // namespace plumbline::eval
