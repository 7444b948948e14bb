#include "sim/world.h"

#include <cmath>
#include <numbers>

namespace plumbline::sim {

World make_world(const ScenarioConfig& scenario, const Trajectory& trajectory, core::TrialId id) {
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

}  // namespace plumbline::sim
