#include "sim/world.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include <fmt/format.h>

#include "core/error.h"
#include "core/physical_ranges.h"
#include "sim/world_lines.h"

namespace plumbline::sim {
namespace {

struct WorldMaker {
  WorldType type;
  World (*make)(const ScenarioConfig& scenario, const Trajectory& trajectory, core::TrialId id);
};

constexpr std::array<WorldMaker, kWorldTypeNames.size()> kWorldMakers = {{{WorldType::kShell, shell_world},
                                                                          {WorldType::kFrustum, frustum_world},
                                                                          {WorldType::kPlanes, planes_world},
                                                                          {WorldType::kRooms, rooms_world},
                                                                          {WorldType::kCorridor, corridor_world}}};

void refuse_path_through_walls(const Walls& walls, const std::vector<Eigen::Vector3d>& path_W) {
  for (std::size_t i = 1; i < path_W.size(); ++i) {
    if (walls.occluded(path_W[i - 1], path_W[i])) {
      throw core::RuleError({"scenario.world.walls.clearance_m", "must be larger: the path passes through a wall"});
    }
  }
}

}  // namespace

std::vector<Eigen::Vector3d> Path::all() const {
  std::vector<Eigen::Vector3d> points = body_W;
  points.insert(points.end(), camera_W.begin(), camera_W.end());
  return points;
}

Path sample_path(const ScenarioConfig& scenario, const Trajectory& trajectory) {
  constexpr double kRateHz = 100.0;
  const core::RigCalibration calibration = scenario.calibration();
  const int n = static_cast<int>(std::ceil(kRateHz * scenario.duration_s));
  Path path;
  for (int i = 0; i <= n; ++i) {
    const core::Pose T_W_B = trajectory.pose_at(scenario.duration_s * i / n);
    path.body_W.push_back(T_W_B.p);
    path.camera_W.push_back(T_W_B * calibration.T_B_C.p);
    if (!(path.camera_W.back().array().abs() <= core::kMostPathM).all()) {
      throw core::RuleError(
          {"scenario.trajectory", fmt::format("must stay within {} m for a world about its path", core::kMostPathM)});
    }
  }
  return path;
}

World make_world(const ScenarioConfig& scenario, const Trajectory& trajectory, core::TrialId id) {
  const auto entry = std::find_if(kWorldMakers.begin(), kWorldMakers.end(),
                                  [&](const WorldMaker& e) { return e.type == scenario.world.type; });
  if (entry == kWorldMakers.end()) throw std::logic_error("make_world: unknown type");
  World world = entry->make(scenario, trajectory, id);
  if (!world.walls.walls.empty()) {
    const Path path = sample_path(scenario, trajectory);
    refuse_path_through_walls(world.walls, path.body_W);
    refuse_path_through_walls(world.walls, path.camera_W);
  }
  if (scenario.lines.per_frame > 0) world.segments_W = make_segments(scenario, trajectory, world, id);
  return world;
}

World shell_world(const ScenarioConfig& scenario, const Trajectory& trajectory, core::TrialId id) {
  const WorldConfig& config = scenario.world;
  const core::RandomStream stream(id.shared(), "world/shell");
  World world;
  world.points_W.reserve(static_cast<std::size_t>(config.landmarks));
  for (int i = 0; i < config.landmarks; ++i) {
    const auto u = stream.uniforms(static_cast<std::uint64_t>(i));
    const Eigen::Vector3d centre = trajectory.pose_at(u[0] * scenario.duration_s).p;
    const double distance = config.nearest_m + u[1] * (config.farthest_m - config.nearest_m);
    // Archimedes: the height of a uniform point on the sphere is uniform.
    const double z = 2.0 * u[2] - 1.0;
    const double angle = 2.0 * std::numbers::pi * u[3];
    const double r = std::sqrt(1.0 - z * z);
    world.points_W.emplace_back(centre + distance * Eigen::Vector3d(r * std::cos(angle), r * std::sin(angle), z));
  }
  return world;
}

World frustum_world(const ScenarioConfig& scenario, const Trajectory& trajectory, core::TrialId id) {
  const WorldConfig& config = scenario.world;
  const core::RandomStream stream(id.shared(), "world/frustum");
  const core::RigCalibration calibration = scenario.calibration();
  const auto& camera = scenario.camera.model;
  World world;
  world.points_W.reserve(static_cast<std::size_t>(config.landmarks));
  // Pixels beyond the fold of the lens have no ray and are drawn again.
  constexpr std::uint64_t kMostDraws = 10000;
  for (int i = 0; i < config.landmarks; ++i) {
    for (std::uint64_t draw = 0;; ++draw) {
      if (draw == kMostDraws) {
        throw core::RuleError({"scenario.camera.distortion_coefficients",
                               "must be weaker, or scenario.world.type another: hardly any pixel has a ray for "
                               "`frustum` to draw from"});
      }
      const auto u = stream.uniforms(static_cast<std::uint64_t>(i), draw);
      const auto ray = camera.try_unproject({u[1] * camera.width_px - 0.5, u[2] * camera.height_px - 0.5});
      if (!ray) continue;
      const core::Pose T_W_C = trajectory.pose_at(u[0] * scenario.duration_s) * calibration.T_B_C;
      const double depth = config.nearest_m + u[3] * (config.farthest_m - config.nearest_m);
      world.points_W.emplace_back(T_W_C * Eigen::Vector3d(depth / ray->z() * *ray));
      break;
    }
  }
  return world;
}

}  // namespace plumbline::sim
