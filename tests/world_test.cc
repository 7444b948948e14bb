#include "sim/world.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "sim/wall_landmarks.h"

namespace plumbline::sim {
namespace {

constexpr core::TrialId kId{.seed = 3, .trial = 0};

Wall wall_with_door() {
  Wall wall = upright_wall({0.0, 0.0}, {4.0, 0.0}, -1.0, 2.0);
  wall.openings = {{Eigen::Vector2d(1.0, 0.0), Eigen::Vector2d(2.0, 2.0)}};
  return wall;
}

TEST(Walls, HideWhatIsBehindThem) {
  const Walls walls{{wall_with_door()}};
  EXPECT_TRUE(walls.occluded({3.0, -1.0, 0.0}, {3.0, 1.0, 0.0}));
  EXPECT_TRUE(walls.occluded({3.0, 1.0, 0.0}, {3.0, -1.0, 0.0}));
  EXPECT_FALSE(walls.occluded({3.0, 1.0, 0.0}, {3.0, 2.0, 0.0}));   // both on one side
  EXPECT_FALSE(walls.occluded({1.5, -1.0, 0.0}, {1.5, 1.0, 0.5}));  // through the door
  EXPECT_TRUE(walls.occluded({1.5, -1.0, 1.5}, {1.5, 1.0, 1.5}));   // above it
  EXPECT_FALSE(walls.occluded({5.0, -1.0, 0.0}, {5.0, 1.0, 0.0}));  // beside the wall
  EXPECT_FALSE(walls.occluded({3.0, -1.0, 2.5}, {3.0, 1.0, 2.5}));  // over it
  EXPECT_FALSE(walls.occluded({3.0, -1.0, 0.0}, {3.0, 0.0, 0.0}));  // a point on the wall is seen from both sides
  EXPECT_FALSE(walls.occluded({3.0, 1.0, 0.0}, {3.0, 0.0, 0.0}));
  EXPECT_TRUE(walls.occluded({0.0, -1.0, 0.0}, {4.0, 0.1, 0.0}));  // at a slant, past the door's left post
}

TEST(Walls, ABuiltWallHasItsNormalOnTheRight) {
  EXPECT_EQ(upright_wall({0.0, 0.0}, {4.0, 0.0}, -1.0, 2.0).normal_W(), -Eigen::Vector3d::UnitY());
  EXPECT_EQ(level_face({0.0, 0.0}, {1.0, 0.0}, {0.0, 2.0}, 1.0).normal_W(), Eigen::Vector3d::UnitZ());
}

TEST(Walls, TurnedRoundIsTheSameSetOfPoints) {
  const Wall wall = wall_with_door();
  const Wall other = turned_round(wall);
  EXPECT_EQ(other.normal_W(), -wall.normal_W());
  for (int i = 0; i < 22; ++i) {
    for (int j = 0; j < 18; ++j) {
      const double a = -0.5 + 0.25 * i;
      const double b = -0.45 + 0.25 * j;
      const Eigen::Vector3d d = wall.at({a, b}) - other.corner_W;
      EXPECT_EQ(other.solid({d.dot(other.u_W), d.dot(other.v_W)}), wall.solid({a, b})) << a << ' ' << b;
    }
  }
}

TEST(Walls, LandmarksLieBeforeTheFaceAndNotInTheDoor) {
  const Wall wall = wall_with_door();
  const Walls walls{{wall}};
  const auto points = scatter_on({wall}, 2000, core::RandomStream(kId, "test"));
  int beside = 0;
  for (const Eigen::Vector3d& p : points) {
    EXPECT_NEAR((p - wall.corner_W).dot(wall.normal_W()), kBeforeWallM, 1e-12);
    EXPECT_FALSE(p.x() > 1.0 && p.x() < 2.0 && p.z() < 1.0);
    EXPECT_FALSE(walls.occluded({2.5, -3.0, 0.5}, p));  // from before the wall
    // From behind none, but for those beside the door, which a slanting line through it meets.
    const bool beside_door = p.x() > 0.98 && p.x() < 2.02 && p.z() < 1.02;
    EXPECT_TRUE(beside_door || walls.occluded({2.5, 3.0, 0.5}, p)) << p.transpose();
    beside += p.x() > 2.0 ? 1 : 0;
  }
  // 2 x 3 of the 4 x 3 - 1 x 2 m^2; five sigmas of a binomial share.
  EXPECT_NEAR(beside / 2000.0, 0.6, 5.0 * std::sqrt(0.6 * 0.4 / 2000.0));
}

ScenarioConfig scenario_of(WorldType type) {
  ScenarioConfig scenario;
  scenario.duration_s = 20.0;
  scenario.trajectory.type = TrajectoryType::kFigureEight;
  scenario.trajectory.loop.radius_m = 6.0;
  scenario.trajectory.loop.period_s = 20.0;
  scenario.world.type = type;
  scenario.world.landmarks = 2000;
  return scenario;
}

class EveryWorld : public testing::TestWithParam<WorldType> {
 protected:
  ScenarioConfig scenario_ = scenario_of(GetParam());
  std::unique_ptr<const Trajectory> trajectory_ = make_trajectory(scenario_.trajectory, scenario_.duration_s, kId);
};

TEST_P(EveryWorld, HasItsLandmarksForEveryTrialAlike) {
  const World world = make_world(scenario_, *trajectory_, kId);
  EXPECT_EQ(world.points_W.size(), 2000U);
  EXPECT_TRUE(std::all_of(world.points_W.begin(), world.points_W.end(), [](const auto& p) { return p.allFinite(); }));
  EXPECT_EQ(make_world(scenario_, *trajectory_, {.seed = 3, .trial = 7}).points_W, world.points_W);
  EXPECT_NE(make_world(scenario_, *trajectory_, {.seed = 4, .trial = 0}).points_W, world.points_W);
}

// Places on a grid of 10 cm over every wall, against the path.
TEST_P(EveryWorld, WallsKeepTheirClearance) {
  const World world = make_world(scenario_, *trajectory_, kId);
  const std::vector<Eigen::Vector3d> path = sample_path(scenario_, *trajectory_).all();
  for (const Wall& wall : world.walls.walls) {
    const Eigen::Vector2i steps = (wall.size_m / 0.1).cast<int>();
    for (int i = 0; i <= steps.x(); ++i) {
      for (int j = 0; j <= steps.y(); ++j) {
        const Eigen::Vector2d ab(0.1 * i, 0.1 * j);
        if (!wall.solid(ab)) continue;
        const Eigen::Vector3d place = wall.at(ab);
        const bool clear = std::all_of(path.begin(), path.end(), [&](const Eigen::Vector3d& p) {
          return (p - place).squaredNorm() > 0.399 * 0.399;
        });
        ASSERT_TRUE(clear) << place.transpose();
      }
    }
  }
}

TEST_P(EveryWorld, HidesOnlyIfAsked) {
  const bool has_walls = GetParam() != WorldType::kShell && GetParam() != WorldType::kFrustum;
  const auto hidden = [&](bool occlusion) {
    scenario_.world.walls.occlusion = occlusion;
    const World world = make_world(scenario_, *trajectory_, kId);
    const Eigen::Vector3d camera = trajectory_->pose_at(1.0).p;
    return std::count_if(world.points_W.begin(), world.points_W.end(),
                         [&](const Eigen::Vector3d& p) { return world.occluded(camera, p); });
  };
  EXPECT_EQ(hidden(true) > 100, has_walls);
  EXPECT_EQ(hidden(false), 0);
}

INSTANTIATE_TEST_SUITE_P(Types, EveryWorld,
                         testing::Values(WorldType::kShell, WorldType::kFrustum, WorldType::kPlanes, WorldType::kRooms,
                                         WorldType::kCorridor),
                         [](const auto& type) {
                           return std::string(kWorldTypeNames[static_cast<std::size_t>(type.param)]);
                         });

// A rig at rest sees every landmark of its frusta, each at a depth in the range.
TEST(Frustum, LandmarksAreInThePicture) {
  ScenarioConfig scenario = scenario_of(WorldType::kFrustum);
  scenario.trajectory.type = TrajectoryType::kStatic;
  const auto trajectory = make_trajectory(scenario.trajectory, scenario.duration_s, kId);
  const core::Pose T_C_W = (trajectory->pose_at(0.0) * scenario.calibration().T_B_C).inverse();
  for (const Eigen::Vector3d& P_W : make_world(scenario, *trajectory, kId).points_W) {
    const Eigen::Vector3d P_C = T_C_W * P_W;
    const auto pixel = scenario.camera.model.project(P_C);
    ASSERT_TRUE(pixel.has_value());
    EXPECT_TRUE(scenario.camera.model.contains(*pixel));
    EXPECT_GE(P_C.z(), scenario.world.nearest_m - 1e-12);
    EXPECT_LE(P_C.z(), scenario.world.farthest_m + 1e-12);
  }
}

// A straight walk of 10 m along a slant of 30 degrees, which the grid's directions include.
TEST(Corridor, IsOneCellWideAlongAStraightPath) {
  ScenarioConfig scenario = scenario_of(WorldType::kCorridor);
  scenario.trajectory.type = TrajectoryType::kConstantAcceleration;
  scenario.trajectory.constant.rate_rad_s.setZero();
  scenario.trajectory.constant.acceleration_m_s2.setZero();
  scenario.trajectory.constant.velocity_m_s = 0.5 * Eigen::Vector3d(std::cos(3.141592653589793 / 6.0), 0.5, 0.0);
  const auto trajectory = make_trajectory(scenario.trajectory, scenario.duration_s, kId);
  const World world = make_world(scenario, *trajectory, kId);
  ASSERT_EQ(world.walls.walls.size(), 4U);
  std::vector<double> lengths;
  for (const Wall& wall : world.walls.walls) lengths.push_back(wall.size_m.x());
  std::sort(lengths.begin(), lengths.end());
  EXPECT_NEAR(lengths[0], 2.0, 1e-9);
  EXPECT_NEAR(lengths[1], 2.0, 1e-9);
  EXPECT_NEAR(lengths[2], lengths[3], 1e-9);
  EXPECT_NEAR(lengths[3], 12.0, 2.01);
}

TEST(Rooms, NeighboursHaveADoorAndThePathUsesSome) {
  const ScenarioConfig scenario = scenario_of(WorldType::kRooms);
  const auto trajectory = make_trajectory(scenario.trajectory, scenario.duration_s, kId);
  const World world = make_world(scenario, *trajectory, kId);
  ASSERT_GT(world.walls.walls.size(), 4U);
  const Path path = sample_path(scenario, *trajectory);
  int passages = 0;
  for (std::size_t i = 4; i < world.walls.walls.size(); ++i) {
    Wall wall = world.walls.walls[i];
    EXPECT_FALSE(wall.openings.empty());
    wall.openings.clear();
    for (std::size_t k = 1; k < path.body_W.size(); ++k) passages += occludes(wall, path.body_W[k - 1], path.body_W[k]);
  }
  EXPECT_GT(passages, 0);
  for (std::size_t i = 0; i < 4; ++i) EXPECT_TRUE(world.walls.walls[i].openings.empty());
}

TEST(Planes, WithoutRoomAreRefused) {
  ScenarioConfig scenario = scenario_of(WorldType::kPlanes);
  scenario.trajectory.type = TrajectoryType::kStatic;
  scenario.world.nearest_m = 0.1;
  scenario.world.farthest_m = 0.2;
  const auto trajectory = make_trajectory(scenario.trajectory, scenario.duration_s, kId);
  try {
    make_world(scenario, *trajectory, kId);
    FAIL() << "found a place";
  } catch (const core::RuleError& error) {
    EXPECT_THAT(error.what(), testing::StartsWith("scenario.world.planes: no place for plane 1"));
  }
}

}  // namespace
}  // namespace plumbline::sim
