// The static world of a scenario, the same in every trial of an experiment.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "core/random.h"
#include "sim/scenario.h"
#include "sim/segment.h"
#include "sim/trajectory.h"
#include "sim/walls.h"

namespace plumbline::sim {

// World coordinates in metres.
struct World {
  std::vector<Eigen::Vector3d> points_W;  // landmarks; those on a wall lie a few millimetres before it
  std::vector<Segment> segments_W = {};   // likewise
  Walls walls;
  // What carries landmarks and segments, seen from where the normals point.
  std::vector<Wall> faces = {};
  bool walls_hide = false;  // else the walls carry landmarks and hide nothing

  bool occluded(const Eigen::Vector3d& camera_W, const Eigen::Vector3d& P_W) const {
    return walls_hide && walls.occluded(camera_W, P_W);
  }
};

// Sized by the path; neither body nor camera passes through a wall. Throws core::RuleError where that cannot be.
World make_world(const ScenarioConfig& scenario, const Trajectory& trajectory, core::TrialId id);

// The positions of the body, then those of the camera, at 100 Hz; the spacing of neighbours is what a wall's clearance
// must exceed.
struct Path {
  std::vector<Eigen::Vector3d> body_W;
  std::vector<Eigen::Vector3d> camera_W;

  std::vector<Eigen::Vector3d> all() const;
};
Path sample_path(const ScenarioConfig& scenario, const Trajectory& trajectory);

// Each landmark lies nearest_m to farthest_m (uniform) from where the body is at a random time, in a random direction.
World shell_world(const ScenarioConfig& scenario, const Trajectory& trajectory, core::TrialId id);

// Each is at a random pixel and depth (uniform) of the camera's middle row at a random time.
World frustum_world(const ScenarioConfig& scenario, const Trajectory& trajectory, core::TrialId id);

// Uniform on squares whose centres lie as the shell's landmarks do and whose normals are within about 45 degrees of the
// direction to the path.
World planes_world(const ScenarioConfig& scenario, const Trajectory& trajectory, core::TrialId id);

// Uniform on walls, floor and ceiling of a house about the path. Walls divide it where the path comes near them least,
// within a quarter of a room of equal division, and open wherever the path comes nearer than the clearance.
World rooms_world(const ScenarioConfig& scenario, const Trajectory& trajectory, core::TrialId id);

// Uniform on walls, floor and ceiling of the cells of a square grid that the path with its clearance enters. The grid
// is turned and shifted so that they are few: straight parts of the path are corridors one cell wide.
World corridor_world(const ScenarioConfig& scenario, const Trajectory& trajectory, core::TrialId id);

}  // namespace plumbline::sim
