// First values of lines: exact rays give the exact line, and what says nothing of a line is put off.
#include "estimator/line_triangulation.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "core/random.h"

namespace plumbline::estimator {
namespace {

const core::PinholeCamera kCamera;
const core::RandomStream kRandom({77, 0}, "line_triangulation_test");

// The ends of a segment need not be the same places of the line from view to view.
struct Segment {
  Eigen::Vector3d C;
  Eigen::Vector3d D;
};

View see(const core::Pose& T_W_C, const Eigen::Vector3d& P_W) {
  return {T_W_C, kCamera.project(T_W_C.inverse() * P_W).value()};
}
SegmentView see(const core::Pose& first, const core::Pose& second, const Segment& s) {
  return {see(first, s.C), see(second, s.D)};
}
SegmentView see(const core::Pose& T_W_C, const Segment& s) { return see(T_W_C, T_W_C, s); }

core::Pose pose(const Eigen::Vector3d& turn, const Eigen::Vector3d& p) { return {core::exp_quaternion(turn), p}; }

// The largest distance of the segment's ends from the line, over |d|.
double distance_m(const TriangulatedLine& found, const Segment& s) {
  const PluckerLine L = OrthonormalLine(found.line->data()).plucker();
  double largest = 0.0;
  for (const Eigen::Vector3d& P : {s.C, s.D}) {
    largest = std::max(largest, ((P - found.origin_W).cross(L.d) - L.n).norm() / L.d.norm());
  }
  return largest;
}

const Segment kSegment{{-0.5, 0.4, 4.0}, {0.7, -0.3, 5.0}};
// Far from a straight path.
const std::vector<core::Pose> kPoses = {pose({0.0, 0.0, 0.0}, {0.1, 0.2, 0.3}),
                                        pose({0.02, -0.05, 0.1}, {0.5, 0.3, 0.2}),
                                        pose({-0.03, 0.04, -0.1}, {0.3, -0.3, 0.5})};

TEST(LineTriangulation, ExactRaysGiveTheExactLine) {
  std::vector<SegmentView> views;
  for (std::size_t i = 0; i < kPoses.size(); ++i) {
    // Another piece of the line each time.
    const double shift = 0.1 * static_cast<double>(i);
    const Eigen::Vector3d d = kSegment.D - kSegment.C;
    views.push_back(see(kPoses[i], Segment{kSegment.C + shift * d, kSegment.D - 2.0 * shift * d}));
  }
  for (std::size_t n = 2; n <= views.size(); ++n) {
    const TriangulatedLine found = triangulate_line(kCamera, {views.begin(), views.begin() + static_cast<long>(n)}, {});
    ASSERT_TRUE(found.line) << n;
    EXPECT_EQ(found.deferral, LineDeferral::kNone);
    EXPECT_EQ(found.origin_W, kPoses[0].p);
    EXPECT_LT(distance_m(found, kSegment), 1e-10) << n;
  }
}

// A rolling shutter: each end from a pose of its own. One pose for both would be off by centimetres.
TEST(LineTriangulation, EachEndHasItsOwnPose) {
  std::vector<SegmentView> views;
  std::vector<SegmentView> as_global;
  for (const core::Pose& first : kPoses) {
    const core::Pose second = first * pose({0.004, -0.003, 0.005}, {0.01, -0.02, 0.01});
    views.push_back(see(first, second, kSegment));
    as_global.push_back({View{first, views.back()[0].pixel}, View{first, views.back()[1].pixel}});
  }
  for (const std::size_t n : {2U, 3U}) {
    const TriangulatedLine found = triangulate_line(kCamera, {views.begin(), views.begin() + static_cast<long>(n)}, {});
    ASSERT_TRUE(found.line) << n;
    EXPECT_LT(distance_m(found, kSegment), 1e-9) << n;
  }
  const TriangulatedLine global = triangulate_line(kCamera, as_global, {.largest_depth_sigma = 10.0});
  ASSERT_TRUE(global.line);
  EXPECT_GT(distance_m(global, kSegment), 0.02);
}

// The line through the camera centres lies in all planes and must not be found instead.
TEST(LineTriangulation, AStraightPathIsNoTrouble) {
  std::vector<SegmentView> views;
  for (const double x : {0.0, 0.2, 0.4, 0.6}) views.push_back(see(pose({0.0, 0.02 * x, 0.0}, {x, 0.0, 0.0}), kSegment));
  const TriangulatedLine found = triangulate_line(kCamera, views, {});
  ASSERT_TRUE(found.line);
  EXPECT_LT(distance_m(found, kSegment), 1e-10);
}

// Noisy ends: the ends of the true segment are as far from the line as the depth's sigma that a share of 0.3 allows,
// and in most cases far nearer.
TEST(LineTriangulation, NoiseMovesItWithinReason) {
  std::vector<double> errors;
  for (std::uint64_t draw = 0; draw < 200; ++draw) {
    std::vector<SegmentView> views;
    for (std::uint64_t i = 0; i < kPoses.size(); ++i) {
      SegmentView view = see(kPoses[i], kSegment);
      for (std::uint64_t e = 0; e < 2; ++e) view[e].pixel += kRandom.normal2(draw, 2 * i + e);
      views.push_back(view);
    }
    const TriangulatedLine found = triangulate_line(kCamera, views, {});
    if (found.line) errors.push_back(distance_m(found, kSegment));
  }
  ASSERT_GT(errors.size(), 150U);
  std::sort(errors.begin(), errors.end());
  // A pixel is 1 cm at 4.5 m; baselines of 0.4 to 0.6 m multiply it by about ten in depth.
  EXPECT_LT(errors[errors.size() / 2], 0.15);
  EXPECT_LT(errors.back(), 1.0);
}

TEST(LineTriangulation, OneViewIsTooFew) {
  const TriangulatedLine found = triangulate_line(kCamera, {see(kPoses[0], kSegment)}, {});
  EXPECT_FALSE(found.line);
  EXPECT_EQ(found.deferral, LineDeferral::kTooFewViews);
}

TEST(LineTriangulation, PureRotationTellsNoDepth) {
  std::vector<SegmentView> views;
  for (const double a : {0.0, 0.05, 0.1}) views.push_back(see(pose({a, -a, 0.3 * a}, {0.1, 0.2, 0.3}), kSegment));
  const TriangulatedLine found = triangulate_line(kCamera, views, {});
  EXPECT_FALSE(found.line);
  EXPECT_EQ(found.deferral, LineDeferral::kNoParallax);
}

// A line parallel to a straight path lies in one epipolar plane, whatever the baseline; and so does one that meets it.
TEST(LineTriangulation, ALineInTheEpipolarPlaneTellsNoDepth) {
  for (const Segment& s : {Segment{{-1.0, 0.5, 4.0}, {1.0, 0.5, 4.0}}, Segment{{-0.5, 0.5, 4.0}, {0.5, 1.0, 8.0}}}) {
    std::vector<SegmentView> views;
    for (const double x : {0.0, 0.3, 0.6}) views.push_back(see(pose({0.0, 0.0, 0.0}, {x, 0.0, 0.0}), s));
    const TriangulatedLine found = triangulate_line(kCamera, views, {});
    EXPECT_FALSE(found.line);
    EXPECT_EQ(found.deferral, LineDeferral::kNoParallax);
    // A view from beside the plane tells.
    views.push_back(see(pose({0.0, 0.0, 0.0}, {0.3, -0.5, 0.0}), s));
    const TriangulatedLine later = triangulate_line(kCamera, views, {});
    ASSERT_TRUE(later.line);
    EXPECT_LT(distance_m(later, s), 1e-9);
  }
}

// At 1 px a line 10 km away is as good as at infinity.
TEST(LineTriangulation, ALineAtInfinityIsPutOff) {
  const Segment far{{-1000.0, 800.0, 10000.0}, {1500.0, -700.0, 10000.0}};
  std::vector<SegmentView> views;
  for (const core::Pose& T : kPoses) views.push_back(see(T, far));
  EXPECT_EQ(triangulate_line(kCamera, views, {}).deferral, LineDeferral::kNoParallax);
  // Known however well, it is beyond what is plausible.
  EXPECT_EQ(triangulate_line(kCamera, views, {.sigma_px = 1e-6}).deferral, LineDeferral::kOutOfRange);
}

// Seen end on, a line is a point.
TEST(LineTriangulation, ALineThroughTheCameraIsPutOff) {
  const Eigen::Vector3d c = kPoses[0].p;
  const Segment through{c + Eigen::Vector3d(0.2, 0.1, 2.0), c + Eigen::Vector3d(0.4, 0.2, 4.0)};
  for (const std::size_t first : {0U, 1U}) {
    std::vector<SegmentView> views;
    for (std::size_t i = 0; i < kPoses.size(); ++i) views.push_back(see(kPoses[(first + i) % 3], through));
    const TriangulatedLine found = triangulate_line(kCamera, views, {});
    if (first == 0) {
      EXPECT_FALSE(found.line);
      EXPECT_EQ(found.deferral, LineDeferral::kNoDirection);
    } else if (found.line) {
      // Seen by another camera first, it is a line like any other.
      EXPECT_LT(distance_m(found, through), 1e-8);
    }
  }
}

// Poses that contradict each other put it behind: the second camera on the wrong side of the first.
TEST(LineTriangulation, ALineBehindTheCameraIsNone) {
  SegmentView second = see(pose({0.0, 0.0, 0.0}, {0.4, 0.3, 0.0}), kSegment);
  for (View& end : second) end.T_W_C.p = {-0.4, -0.3, 0.0};
  const TriangulatedLine found = triangulate_line(kCamera, {see(pose({0, 0, 0}, {0, 0, 0}), kSegment), second}, {});
  EXPECT_FALSE(found.line);
  EXPECT_EQ(found.deferral, LineDeferral::kBehind);
}

TEST(LineTriangulation, InFrontIsOfWhatTheEndsSaw) {
  const TriangulatedLine found = triangulate_line(kCamera, {see(kPoses[0], kSegment), see(kPoses[1], kSegment)}, {});
  ASSERT_TRUE(found.line);
  const PluckerLine L = OrthonormalLine(found.line->data()).plucker();
  SegmentView view = see(kPoses[2], kSegment);
  EXPECT_TRUE(in_front(kCamera, view, L, found.origin_W));
  // The same plane through the centre, seen over the shoulder: turned by half a turn about the plane's normal.
  const Eigen::Vector3d normal = (kSegment.C - kPoses[2].p).cross(kSegment.D - kPoses[2].p).normalized();
  const Eigen::Quaterniond half_turn(Eigen::AngleAxisd(std::numbers::pi, normal));
  view[1].T_W_C.q = half_turn * view[1].T_W_C.q;
  EXPECT_FALSE(in_front(kCamera, view, L, found.origin_W));
}

// Whatever the pixels and poses are, the answer is finite and in front, or none.
TEST(LineTriangulation, NonsenseGivesNoNonsense) {
  int found_lines = 0;
  for (std::uint64_t draw = 0; draw < 2000; ++draw) {
    std::vector<SegmentView> views;
    const double spread = std::pow(10.0, -3.0 * kRandom.uniform(draw, 100));
    for (std::uint64_t i = 0; i < 2 + draw % 3; ++i) {
      SegmentView view;
      for (std::uint64_t e = 0; e < 2; ++e) {
        const std::uint64_t at = 10 * i + 4 * e;
        view[e] = {pose(spread * kRandom.normal3(draw, at), spread * kRandom.normal3(draw, at + 1)),
                   {640.0 * kRandom.uniform(draw, at + 2), 480.0 * kRandom.uniform(draw, at + 3)}};
      }
      if (draw % 5 == 0) view[1] = view[0];
      views.push_back(view);
    }
    const TriangulatedLine found = triangulate_line(kCamera, views, {});
    EXPECT_EQ(found.line.has_value(), found.deferral == LineDeferral::kNone);
    if (!found.line) continue;
    ++found_lines;
    ASSERT_TRUE(found.line->allFinite());
    const PluckerLine L = OrthonormalLine(found.line->data()).plucker();
    for (const SegmentView& view : views) EXPECT_TRUE(in_front(kCamera, view, L, found.origin_W));
  }
  EXPECT_GT(found_lines, 0);
}

}  // namespace
}  // namespace plumbline::estimator
