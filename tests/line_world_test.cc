// The segments of the worlds: where they lie, and that every trial has the same.
#include <algorithm>
#include <cmath>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "sim/face_lines.h"
#include "sim/wall_landmarks.h"
#include "sim/world.h"
#include "sim/world_lines.h"

namespace plumbline::sim {
namespace {

constexpr core::TrialId kId{.seed = 3, .trial = 0};

ScenarioConfig scenario_of(WorldType type) {
  ScenarioConfig scenario;
  scenario.duration_s = 20.0;
  scenario.trajectory.type = TrajectoryType::kFigureEight;
  scenario.trajectory.loop.radius_m = 6.0;
  scenario.trajectory.loop.period_s = 20.0;
  scenario.world.type = type;
  scenario.world.landmarks = 200;
  scenario.world.lines.random = 100;
  scenario.lines.per_frame = 30;
  return scenario;
}

World world_of(const ScenarioConfig& scenario, core::TrialId id = kId) {
  return make_world(scenario, *make_trajectory(scenario.trajectory, scenario.duration_s, id), id);
}

bool same(const std::vector<Segment>& a, const std::vector<Segment>& b) {
  return std::ranges::equal(a, b, {}, &Segment::ends_W, &Segment::ends_W);
}

double length(const Segment& s) { return (s.ends_W[1] - s.ends_W[0]).norm(); }

// A face in which a point lies kBeforeWallM before the wall.
bool lies_on(const Wall& face, const Eigen::Vector3d& P) {
  const Eigen::Vector3d d = P - face.corner_W;
  return std::abs(d.dot(face.normal_W()) - kBeforeWallM) < 1e-9 && face.solid({d.dot(face.u_W), d.dot(face.v_W)});
}

class EveryLineWorld : public testing::TestWithParam<WorldType> {
 protected:
  ScenarioConfig scenario_ = scenario_of(GetParam());
};

TEST_P(EveryLineWorld, HasItsSegmentsForEveryTrialAlike) {
  const World world = world_of(scenario_);
  EXPECT_GE(world.segments_W.size(), 100U);
  for (const Segment& s : world.segments_W) {
    EXPECT_TRUE(s.ends_W[0].allFinite() && s.ends_W[1].allFinite());
    EXPECT_GT(length(s), 0.01);
  }
  EXPECT_TRUE(same(world_of(scenario_, {.seed = 3, .trial = 7}).segments_W, world.segments_W));
  EXPECT_FALSE(same(world_of(scenario_, {.seed = 4, .trial = 0}).segments_W, world.segments_W));
}

// Lines change neither landmarks nor walls, and a scenario that tracks none has none.
TEST_P(EveryLineWorld, LeavesTheRestOfTheWorldAlone) {
  const World with = world_of(scenario_);
  scenario_.lines.per_frame = 0;
  const World without = world_of(scenario_);
  EXPECT_TRUE(without.segments_W.empty());
  EXPECT_EQ(with.points_W, without.points_W);
  EXPECT_EQ(with.walls.walls.size(), without.walls.walls.size());
}

// All but the outer corners, which lie before two walls and beside both faces.
TEST_P(EveryLineWorld, SegmentsLieBeforeTheFacesAndNotInDoors) {
  if (GetParam() == WorldType::kShell || GetParam() == WorldType::kFrustum) GTEST_SKIP() << "has no faces";
  scenario_.world.lines.edges = GetParam() == WorldType::kPlanes;
  scenario_.world.lines.grid_spacing_m = 0.9;
  scenario_.world.lines.windows.spacing_m = 1.7;
  const World world = world_of(scenario_);
  for (const Segment& s : world.segments_W) {
    for (const double share : {0.001, 0.25, 0.5, 0.75, 0.999}) {
      EXPECT_TRUE(std::ranges::any_of(world.faces, [&](const Wall& face) { return lies_on(face, s.at(share)); }))
          << s.at(share).transpose();
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Types, EveryLineWorld,
                         testing::Values(WorldType::kShell, WorldType::kFrustum, WorldType::kPlanes, WorldType::kRooms,
                                         WorldType::kCorridor),
                         [](const auto& type) {
                           return std::string(kWorldTypeNames[static_cast<std::size_t>(type.param)]);
                         });

Wall wall_with_door() {
  Wall wall = upright_wall({0.0, 0.0}, {4.0, 0.0}, -1.0, 2.0);
  wall.openings = {{Eigen::Vector2d(1.0, 0.0), Eigen::Vector2d(2.0, 2.0)}};
  return wall;
}

TEST(FaceLines, AreCutAtDoors) {
  std::vector<Segment> lines;
  draw_line(wall_with_door(), {0.5, 1.0}, {3.5, 1.0}, lines);
  ASSERT_EQ(lines.size(), 2U);
  // The normal of the wall is -y.
  EXPECT_LT((lines[0].ends_W[0] - Eigen::Vector3d(0.5, -kBeforeWallM, 0.0)).norm(), 1e-12);
  EXPECT_LT((lines[0].ends_W[1] - Eigen::Vector3d(1.0, -kBeforeWallM, 0.0)).norm(), 1e-12);
  EXPECT_LT((lines[1].ends_W[0] - Eigen::Vector3d(2.0, -kBeforeWallM, 0.0)).norm(), 1e-12);
  EXPECT_LT((lines[1].ends_W[1] - Eigen::Vector3d(3.5, -kBeforeWallM, 0.0)).norm(), 1e-12);
  lines.clear();
  draw_line(wall_with_door(), {1.2, 1.0}, {1.2, 2.8}, lines);  // from within the door up
  ASSERT_EQ(lines.size(), 1U);
  EXPECT_NEAR(lines[0].ends_W[0].z(), 1.0, 1e-12);
  lines.clear();
  draw_line(wall_with_door(), {1.2, 1.0}, {1.8, 1.0}, lines);
  EXPECT_TRUE(lines.empty());
}

TEST(FaceLines, DoorFramesAreTwoPostsAndALintel) {
  std::vector<Segment> frame;
  draw_door_frames(wall_with_door(), frame);
  ASSERT_EQ(frame.size(), 3U);
  EXPECT_NEAR(length(frame[0]), 2.0, 1e-12);
  EXPECT_NEAR(frame[0].ends_W[0].x(), 1.0 - kBeforeWallM, 1e-12);
  EXPECT_NEAR(frame[1].ends_W[0].x(), 2.0 + kBeforeWallM, 1e-12);
  EXPECT_NEAR(length(frame[2]), 1.0 + 2.0 * kBeforeWallM, 1e-12);
  EXPECT_NEAR(frame[2].ends_W[0].z(), 1.0 + kBeforeWallM, 1e-12);
}

TEST(FaceLines, WindowsKeepClearOfDoors) {
  std::vector<Segment> lines;
  // Centres at 0.5, 1.5 (in the door), 2.5, 3.5; the door covers 1 to 2.
  draw_windows(wall_with_door(), {.spacing_m = 1.0, .width_m = 0.8, .height_m = 1.0, .sill_m = 1.5}, lines);
  EXPECT_EQ(lines.size(), 3U * 4U);
  for (const Segment& s : lines) EXPECT_FALSE(s.at(0.5).x() > 1.0 && s.at(0.5).x() < 2.0);
  lines.clear();
  draw_windows(wall_with_door(), {.spacing_m = 1.0, .width_m = 0.8, .height_m = 2.0, .sill_m = 1.5}, lines);
  EXPECT_TRUE(lines.empty());  // higher than the wall
}

TEST(FaceLines, GridIsEvenlySpaced) {
  std::vector<Segment> lines;
  draw_grid(upright_wall({0.0, 0.0}, {4.0, 0.0}, -1.0, 2.0), 0.75, lines);
  EXPECT_EQ(lines.size(), 5U + 3U);  // 0.75 to 3.75 along, 0.75 to 2.25 up
  EXPECT_NEAR(lines[1].ends_W[0].x() - lines[0].ends_W[0].x(), 0.75, 1e-12);
}

// An L of walls: inner corners once, kBeforeWallM before both walls, and the outer corner too.
TEST(FaceLines, EdgesLieBeforeBothWalls) {
  // Counter-clockwise from inside; the normal is on the right of the way, so the way is clockwise.
  const std::vector<Eigen::Vector2d> plan = {{0, 0}, {0, 4}, {2, 4}, {2, 2}, {4, 2}, {4, 0}};
  std::vector<Wall> walls;
  for (std::size_t i = 0; i < plan.size(); ++i) {
    walls.push_back(upright_wall(plan[i], plan[(i + 1) % plan.size()], 0.0, 3.0));
  }
  std::vector<Segment> edges;
  draw_edges(walls, edges);
  ASSERT_EQ(edges.size(), 6U + 2U * 6U);
  std::vector<Eigen::Vector2d> posts;
  for (const Segment& s : edges) {
    const bool upright = std::abs(s.ends_W[0].z() - s.ends_W[1].z()) > 1.0;
    if (upright) posts.emplace_back(s.ends_W[0].head<2>());
    EXPECT_NEAR(std::min(s.ends_W[0].z(), s.ends_W[1].z()),
                upright || s.ends_W[0].z() < 1.5 ? kBeforeWallM : 3.0 - kBeforeWallM, 1e-12);
  }
  constexpr double e = kBeforeWallM;
  const std::vector<Eigen::Vector2d> expected = {
      {e, e}, {e, 4.0 - e}, {2.0 - e, 4.0 - e}, {2.0 - e, 2.0 - e}, {4.0 - e, 2.0 - e}, {4.0 - e, e}};
  ASSERT_EQ(posts.size(), expected.size());
  for (const Eigen::Vector2d& x : expected) {
    EXPECT_TRUE(std::ranges::any_of(posts, [&](const Eigen::Vector2d& p) { return (p - x).norm() < 1e-9; }))
        << x.transpose();
  }
}

// Nothing of a house is seen through its walls: from outside all segments are hidden.
TEST(RoomLines, AreHiddenFromOutside) {
  ScenarioConfig scenario = scenario_of(WorldType::kRooms);
  scenario.world.lines.windows.spacing_m = 2.0;
  const World world = world_of(scenario);
  Eigen::AlignedBox3d house;
  for (const Wall& wall : world.walls.walls) house.extend(wall.corner_W).extend(wall.at(wall.size_m));
  const double z = house.center().z();
  for (const Eigen::Vector3d& outside : {Eigen::Vector3d(house.min().x() - 3.0, house.center().y(), z),
                                         Eigen::Vector3d(house.center().x(), house.max().y() + 3.0, z)}) {
    for (const Segment& s : world.segments_W) {
      for (const double share : {0.0, 0.3, 1.0}) EXPECT_TRUE(world.occluded(outside, s.at(share)));
    }
  }
}

// Edges of the house, door frames and windows can be asked for apart.
TEST(RoomLines, KindsAreApart) {
  ScenarioConfig scenario = scenario_of(WorldType::kRooms);
  WorldLinesConfig& lines = scenario.world.lines;
  lines.edges = false;
  lines.doors = false;
  lines.random = 0;
  EXPECT_FALSE(scenario.world.has_lines());
  lines.edges = true;
  const std::size_t edges = world_of(scenario).segments_W.size();
  lines.doors = true;
  const std::size_t with_doors = world_of(scenario).segments_W.size();
  lines.windows.spacing_m = 1.5;
  const std::size_t with_windows = world_of(scenario).segments_W.size();
  EXPECT_GT(edges, 12U);
  EXPECT_GE(with_doors, edges + 4U);
  EXPECT_GT(with_windows, with_doors);
  EXPECT_EQ((with_windows - with_doors) % 4, 0U);
}

TEST(RandomLines, HaveTheLengthsThatAreAskedFor) {
  ScenarioConfig scenario = scenario_of(WorldType::kShell);
  scenario.world.lines.random = 2000;
  scenario.world.lines.random_shortest_m = 0.5;
  scenario.world.lines.random_longest_m = 1.5;
  double sum = 0.0;
  Eigen::Vector3d squares = Eigen::Vector3d::Zero();
  for (const Segment& s : world_of(scenario).segments_W) {
    EXPECT_GT(length(s), 0.5 - 1e-12);
    EXPECT_LT(length(s), 1.5 + 1e-12);
    sum += length(s);
    squares += ((s.ends_W[1] - s.ends_W[0]) / length(s)).cwiseAbs2();
  }
  // Uniform: mean 1, deviation 1/sqrt(12). A squared coordinate of a uniform direction: mean 1/3, variance 4/45.
  EXPECT_NEAR(sum / 2000.0, 1.0, 4.5 / std::sqrt(12.0 * 2000.0));
  for (const double x : squares) EXPECT_NEAR(x / 2000.0, 1.0 / 3.0, 4.5 * std::sqrt(4.0 / 45.0 / 2000.0));
}

TEST(RandomLines, FindNoPlaceInAWallThatIsAllDoor) {
  Wall door = upright_wall({0.0, 0.0}, {4.0, 0.0}, -1.0, 2.0);
  door.openings = {{Eigen::Vector2d(0.0, 0.0), Eigen::Vector2d(4.0, 3.0)}};
  std::vector<Segment> lines;
  WorldLinesConfig config;
  config.random = 1;
  EXPECT_THROW(scatter_lines_on({door}, config, core::RandomStream(kId, "test"), lines), core::RuleError);
}

TEST(LineWorld, WithoutSegmentsIsRefusedWhereLinesAreTracked) {
  ScenarioConfig scenario = scenario_of(WorldType::kShell);
  scenario.world.lines.random = 0;
  const auto violation = validate(scenario);
  ASSERT_TRUE(violation.has_value());
  EXPECT_EQ(violation->key, "lines.per_frame");
  scenario.lines.per_frame = 0;
  EXPECT_FALSE(validate(scenario).has_value());
}

TEST(LineWorld, TooManySegmentsAreRefused) {
  ScenarioConfig scenario = scenario_of(WorldType::kRooms);
  scenario.world.lines.grid_spacing_m = 1e-4;
  EXPECT_THROW(world_of(scenario), core::RuleError);
}

}  // namespace
}  // namespace plumbline::sim
