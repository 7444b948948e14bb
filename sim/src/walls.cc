#include "sim/walls.h"

#include <algorithm>
#include <cmath>

namespace plumbline::sim {

bool Wall::solid(const Eigen::Vector2d& ab) const {
  const bool inside = ab.x() >= 0.0 && ab.y() >= 0.0 && ab.x() <= size_m.x() && ab.y() <= size_m.y();
  return inside && std::none_of(openings.begin(), openings.end(), [&](const auto& box) { return box.contains(ab); });
}

Wall upright_wall(const Eigen::Vector2d& from, const Eigen::Vector2d& to, double bottom_z, double top_z) {
  const Eigen::Vector2d along = to - from;
  Wall wall;
  wall.corner_W << from, bottom_z;
  wall.u_W << along.normalized(), 0.0;
  wall.v_W = Eigen::Vector3d::UnitZ();
  wall.size_m = {along.norm(), top_z - bottom_z};
  return wall;
}

Wall level_face(const Eigen::Vector2d& corner, const Eigen::Vector2d& u, const Eigen::Vector2d& v, double z) {
  Wall wall;
  wall.corner_W << corner, z;
  wall.u_W << u.normalized(), 0.0;
  wall.v_W << v.normalized(), 0.0;
  wall.size_m = {u.norm(), v.norm()};
  return wall;
}

Wall turned_round(const Wall& wall) {
  Wall other = wall;
  other.corner_W = wall.at({wall.size_m.x(), 0.0});
  other.u_W = -wall.u_W;
  for (Eigen::AlignedBox2d& box : other.openings) {
    const double left = wall.size_m.x() - box.max().x();
    box.max().x() = wall.size_m.x() - box.min().x();
    box.min().x() = left;
  }
  return other;
}

bool occludes(const Wall& wall, const Eigen::Vector3d& camera_W, const Eigen::Vector3d& P_W) {
  constexpr double kOnWallM = 1e-6;
  const Eigen::Vector3d n = wall.normal_W();
  const double camera_side_m = n.dot(camera_W - wall.corner_W);
  const double point_side_m = n.dot(P_W - wall.corner_W);
  const bool crosses = (camera_side_m > 0.0) != (point_side_m > 0.0) && std::abs(point_side_m) > kOnWallM;
  if (!crosses) return false;
  const double s = camera_side_m / (camera_side_m - point_side_m);
  const Eigen::Vector3d hit = camera_W + s * (P_W - camera_W) - wall.corner_W;
  return wall.solid({hit.dot(wall.u_W), hit.dot(wall.v_W)});
}

bool Walls::occluded(const Eigen::Vector3d& camera_W, const Eigen::Vector3d& P_W) const {
  return std::any_of(walls.begin(), walls.end(), [&](const Wall& wall) { return occludes(wall, camera_W, P_W); });
}

}  // namespace plumbline::sim
