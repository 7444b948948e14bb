// The static world of a scenario, the same in every trial of an experiment.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "core/random.h"
#include "sim/scenario.h"
#include "sim/trajectory.h"
#include "sim/walls.h"

namespace plumbline::sim {

// World coordinates in metres.
struct World {
  std::vector<Eigen::Vector3d> points_W;  // landmarks; those on a wall lie a few millimetres before it
  Walls walls;
  bool walls_hide = false;  // else the walls carry landmarks and hide nothing

  bool occluded(const Eigen::Vector3d& camera_W, const Eigen::Vector3d& P_W) const {
    return walls_hide && walls.occluded(camera_W, P_W);
  }
};

// `shell`: each landmark lies nearest_m to farthest_m (uniform) from where the body is at a random time, in a random
// direction.
World make_world(const ScenarioConfig& scenario, const Trajectory& trajectory, core::TrialId id);

}  // namespace plumbline::sim
