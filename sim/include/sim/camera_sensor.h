// The tracks of landmarks through the frames of a camera.
#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include <Eigen/Core>

#include "core/measurements.h"
#include "core/random.h"
#include "sim/trajectory.h"

namespace plumbline::sim {

struct CameraRecording {
  std::vector<core::Frame> frames;
  std::map<std::int64_t, int> track_landmark;
};

// Frames stamped at multiples of 1/rate whose every row is exposed within [lead_s, duration_s - lead_s]. A frame
// holds the tracks of the last one that are still visible, then landmarks in their order up to points.per_frame.
// Visibility is decided on noise-free projections, so that the pixel noise is not truncated. Velocities are filled in
// where points.velocity_source is `exact`; finite differences are the tracker's (sim/track_velocity.h).
CameraRecording simulate_camera(const Trajectory& trajectory, const std::vector<Eigen::Vector3d>& landmarks,
                                const ScenarioConfig& config, double lead_s, core::TrialId id);

}  // namespace plumbline::sim
