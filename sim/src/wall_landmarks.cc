#include "sim/wall_landmarks.h"

#include <algorithm>

#include "core/error.h"

namespace plumbline::sim {

std::vector<Eigen::Vector3d> scatter_on(const std::vector<Wall>& faces, int landmarks,
                                        const core::RandomStream& stream) {
  std::vector<double> area_up_to = {0.0};
  for (const Wall& face : faces) area_up_to.push_back(area_up_to.back() + face.size_m.prod());

  // Places in a door are drawn again.
  constexpr std::uint64_t kMostDraws = 10000;
  std::vector<Eigen::Vector3d> points_W;
  points_W.reserve(static_cast<std::size_t>(landmarks));
  for (int i = 0; i < landmarks; ++i) {
    for (std::uint64_t draw = 0;; ++draw) {
      if (draw == kMostDraws) {
        throw core::RuleError({"scenario.world.walls.clearance_m",
                               "must be smaller, or the doors: the walls have hardly any area for landmarks"});
      }
      const auto u = stream.uniforms(static_cast<std::uint64_t>(i), draw);
      const auto above = std::upper_bound(area_up_to.begin() + 1, area_up_to.end() - 1, u[0] * area_up_to.back());
      const Wall& face = faces[static_cast<std::size_t>(above - area_up_to.begin()) - 1];
      const Eigen::Vector2d ab(u[1] * face.size_m.x(), u[2] * face.size_m.y());
      if (!face.solid(ab)) continue;
      points_W.emplace_back(face.at(ab) + kBeforeWallM * face.normal_W());
      break;
    }
  }
  return points_W;
}

}  // namespace plumbline::sim
