// The segments of a world. Those on a face lie kBeforeWallM before it, as the landmarks do, and not in its doors.
//   edge of two faces A and P in the corner x:   x + kBeforeWallM (n_A + n_P), whether they face each other or not
//   random in space: the middle placed as the world places a landmark, the direction uniform on the sphere
#pragma once

#include <vector>

#include "core/random.h"
#include "sim/segment.h"
#include "sim/trajectory.h"
#include "sim/world.h"

namespace plumbline::sim {

// In an order drawn at random, so that a tracker that takes the first has no preference. `world` has its walls and
// faces already. Throws core::RuleError where there is no place for them.
std::vector<Segment> make_segments(const ScenarioConfig& scenario, const Trajectory& trajectory, const World& world,
                                   core::TrialId id);

}  // namespace plumbline::sim
