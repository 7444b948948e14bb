#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include "core/error.h"
#include "sim/wall_landmarks.h"
#include "sim/world.h"

namespace plumbline::sim {
namespace {

// Uniform on the unit sphere.
Eigen::Vector3d direction(double u0, double u1) {
  const double z = 2.0 * u0 - 1.0;
  const double angle = 2.0 * std::numbers::pi * u1;
  const double r = std::sqrt(1.0 - z * z);
  return {r * std::cos(angle), r * std::sin(angle), z};
}

double distance(const Wall& wall, const Eigen::Vector3d& P_W) {
  const Eigen::Vector3d from_corner = P_W - wall.corner_W;
  const Eigen::Vector2d ab(from_corner.dot(wall.u_W), from_corner.dot(wall.v_W));
  return (P_W - wall.at(ab.cwiseMax(0.0).cwiseMin(wall.size_m))).norm();
}

// A square about the centre, its normal near `towards` (unit).
Wall square(const Eigen::Vector3d& centre, double side_m, const Eigen::Vector3d& towards, const Eigen::Vector3d& tilt) {
  const Eigen::Vector3d normal = (towards + 0.7 * tilt).normalized();
  const Eigen::Vector3d u = normal.unitOrthogonal();
  const Eigen::Vector3d v = normal.cross(u);
  return {.corner_W = centre - 0.5 * side_m * (u + v),
          .u_W = u,
          .v_W = v,
          .size_m = Eigen::Vector2d::Constant(side_m),
          .openings = {}};
}

}  // namespace

World planes_world(const ScenarioConfig& scenario, const Trajectory& trajectory, core::TrialId id) {
  const WorldConfig& config = scenario.world;
  const core::RandomStream stream(id.shared(), "world/planes");
  const std::vector<Eigen::Vector3d> path = sample_path(scenario, trajectory).all();
  constexpr std::uint64_t kMostDraws = 1000;
  World world{.points_W = {}, .walls = {}, .walls_hide = config.walls.occlusion};
  for (int i = 0; i < config.planes.count; ++i) {
    for (std::uint64_t draw = 0;; ++draw) {
      if (draw == kMostDraws) {
        throw core::RuleError({"scenario.world.planes",
                               fmt::format("no place for plane {} that is walls.clearance_m = {} m from the path",
                                           i + 1, config.walls.clearance_m)});
      }
      const auto place = stream.uniforms(static_cast<std::uint64_t>(i), 2 * draw);
      const auto turn = stream.uniforms(static_cast<std::uint64_t>(i), 2 * draw + 1);
      const Eigen::Vector3d away = direction(place[2], place[3]);
      const double distance_m = config.nearest_m + place[1] * (config.farthest_m - config.nearest_m);
      const Wall plane = square(trajectory.pose_at(place[0] * scenario.duration_s).p + distance_m * away,
                                config.planes.side_m, -away, direction(turn[0], turn[1]));
      const bool clear = std::all_of(path.begin(), path.end(), [&](const Eigen::Vector3d& p) {
        return distance(plane, p) > config.walls.clearance_m;
      });
      if (!clear) continue;
      world.walls.walls.push_back(plane);
      break;
    }
  }
  world.points_W =
      scatter_on(world.walls.walls, config.landmarks, core::RandomStream(id.shared(), "world/planes_landmarks"));
  world.faces = world.walls.walls;
  return world;
}

}  // namespace plumbline::sim
