#include "sim/wall_landmarks.h"

#include <algorithm>

#include "core/error.h"

namespace plumbline::sim {

FacesByArea::FacesByArea(const std::vector<Wall>& faces) : faces_(faces), area_up_to_({0.0}) {
  for (const Wall& face : faces) area_up_to_.push_back(area_up_to_.back() + face.size_m.prod());
}

const Wall& FacesByArea::at(double u) const {
  const auto above = std::upper_bound(area_up_to_.begin() + 1, area_up_to_.end() - 1, u * area_up_to_.back());
  return faces_[static_cast<std::size_t>(above - area_up_to_.begin()) - 1];
}

std::vector<Eigen::Vector3d> scatter_on(const std::vector<Wall>& faces, int landmarks,
                                        const core::RandomStream& stream) {
  const FacesByArea by_area(faces);
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
      const Wall& face = by_area.at(u[0]);
      const Eigen::Vector2d ab(u[1] * face.size_m.x(), u[2] * face.size_m.y());
      if (!face.solid(ab)) continue;
      points_W.emplace_back(face.at(ab) + kBeforeWallM * face.normal_W());
      break;
    }
  }
  return points_W;
}

}  // namespace plumbline::sim
