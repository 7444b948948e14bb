// Rectangles that hide what is behind them.
//   a point of a wall: corner_W + a u_W + b v_W,  0 <= a <= size_m.x, 0 <= b <= size_m.y, (a, b) in no opening
#pragma once

#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace plumbline::sim {

struct Wall {
  Eigen::Vector3d corner_W = Eigen::Vector3d::Zero();
  Eigen::Vector3d u_W = Eigen::Vector3d::UnitX();  // unit vectors along its edges, at right angles; walls that stand
  Eigen::Vector3d v_W = Eigen::Vector3d::UnitZ();  // upright have v_W upwards
  Eigen::Vector2d size_m = Eigen::Vector2d::Zero();
  std::vector<Eigen::AlignedBox2d> openings;  // doors, in (a, b) [m]; they may overlap

  Eigen::Vector3d normal_W() const { return u_W.cross(v_W); }
  Eigen::Vector3d at(const Eigen::Vector2d& ab) const { return corner_W + ab.x() * u_W + ab.y() * v_W; }
  // Within the rectangle and in no opening.
  bool solid(const Eigen::Vector2d& ab) const;
};

// The vertical wall that stands over the line from `from` to `to`; its normal is on the right of that way.
Wall upright_wall(const Eigen::Vector2d& from, const Eigen::Vector2d& to, double bottom_z, double top_z);

// The level rectangle corner + a u + b v at height z, for u and v at right angles, v on the left of u; its normal
// points up.
Wall level_face(const Eigen::Vector2d& corner, const Eigen::Vector2d& u, const Eigen::Vector2d& v, double z);

// The same wall seen from the other side: its normal points there.
Wall turned_round(const Wall& wall);

// Whether the straight line from the camera to the point passes through the wall. A point within a micrometre of the
// wall's plane is on it, and seen.
bool occludes(const Wall& wall, const Eigen::Vector3d& camera_W, const Eigen::Vector3d& P_W);

struct Walls {
  std::vector<Wall> walls;

  bool occluded(const Eigen::Vector3d& camera_W, const Eigen::Vector3d& P_W) const;
};

}  // namespace plumbline::sim
