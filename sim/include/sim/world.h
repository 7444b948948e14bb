// The static landmarks of a scenario, the same in every trial of an experiment.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "core/random.h"
#include "sim/trajectory.h"

namespace plumbline::sim {

// World coordinates in metres.
// `shell`: each landmark lies nearest_m to farthest_m (uniform) from where the body is at a random time, in a random
// direction.
std::vector<Eigen::Vector3d> make_world(const WorldConfig& config, const Trajectory& trajectory, double duration_s,
                                        core::TrialId id);

}  // namespace plumbline::sim
