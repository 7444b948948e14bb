#include "sim/world_lines.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include "core/error.h"
#include "sim/face_lines.h"
#include "sim/wall_landmarks.h"

namespace plumbline::sim {
namespace {

// Every frame asks each of them whether it is seen.
constexpr std::size_t kMostSegments = 100000;

void require_few(std::size_t segments) {
  if (segments <= kMostSegments) return;
  throw core::RuleError(
      {"scenario.world.lines",
       fmt::format("must be fewer, or the walls smaller: at most {} segments are made", kMostSegments)});
}

bool upright(const Wall& face) { return std::abs(face.normal_W().z()) < 0.5; }

// A world that has as many landmarks as segments are wanted, placed by the world's own rule, gives their middles.
void scatter_in_space(const ScenarioConfig& scenario, const Trajectory& trajectory, core::TrialId id,
                      std::vector<Segment>& segments_W) {
  const WorldLinesConfig& config = scenario.world.lines;
  const core::RandomStream stream(id.shared(), "world/lines");
  ScenarioConfig middles = scenario;
  middles.world.landmarks = config.random;
  const World world = scenario.world.type == WorldType::kShell ? shell_world(middles, trajectory, id)
                                                               : frustum_world(middles, trajectory, id);
  for (std::size_t i = 0; i < world.points_W.size(); ++i) {
    const auto u = stream.uniforms(i);
    const double z = 2.0 * u[0] - 1.0;
    const double angle = 2.0 * std::numbers::pi * u[1];
    const double r = std::sqrt(1.0 - z * z);
    const double length_m = config.random_shortest_m + u[2] * (config.random_longest_m - config.random_shortest_m);
    const Eigen::Vector3d half = 0.5 * length_m * Eigen::Vector3d(r * std::cos(angle), r * std::sin(angle), z);
    segments_W.push_back({{world.points_W[i] - half, world.points_W[i] + half}});
  }
}

std::vector<Segment> in_random_order(std::vector<Segment> segments_W, const core::RandomStream& stream) {
  std::vector<std::pair<double, std::size_t>> order;
  order.reserve(segments_W.size());
  for (std::size_t i = 0; i < segments_W.size(); ++i) order.emplace_back(stream.uniform(i), i);
  std::sort(order.begin(), order.end());
  std::vector<Segment> result;
  result.reserve(order.size());
  for (const auto& [draw, i] : order) result.push_back(segments_W[i]);
  return result;
}

}  // namespace

std::vector<Segment> make_segments(const ScenarioConfig& scenario, const Trajectory& trajectory, const World& world,
                                   core::TrialId id) {
  const WorldLinesConfig& config = scenario.world.lines;
  std::vector<Segment> segments_W;
  require_few(static_cast<std::size_t>(config.random));
  if (world.faces.empty()) {
    if (config.random > 0) scatter_in_space(scenario, trajectory, id, segments_W);
  } else {
    std::vector<Wall> walls;
    for (const Wall& face : world.faces) {
      if (scenario.world.type != WorldType::kPlanes && upright(face)) walls.push_back(face);
    }
    if (config.edges) draw_edges(walls, segments_W);
    for (const Wall& face : world.faces) {
      require_few(segments_W.size());
      if (config.grid_spacing_m > 0.0) {
        require_few(static_cast<std::size_t>(face.size_m.sum() / config.grid_spacing_m));
        draw_grid(face, config.grid_spacing_m, segments_W);
      }
      if (config.edges && scenario.world.type == WorldType::kPlanes) draw_outline(face, kBeforeWallM, segments_W);
    }
    for (const Wall& face : walls) {
      require_few(segments_W.size());
      if (config.doors) draw_door_frames(face, segments_W);
      if (config.windows.spacing_m > 0.0) {
        require_few(static_cast<std::size_t>(face.size_m.x() / config.windows.spacing_m));
        draw_windows(face, config.windows, segments_W);
      }
    }
    scatter_lines_on(world.faces, config, core::RandomStream(id.shared(), "world/lines"), segments_W);
  }
  require_few(segments_W.size());
  return in_random_order(std::move(segments_W), core::RandomStream(id.shared(), "world/line_order"));
}

}  // namespace plumbline::sim
