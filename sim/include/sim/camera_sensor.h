// The tracks of landmarks and segments through the frames of a camera.
//   trigger_n = n/rate + trigger jitter           the true time of frame n, camera clock
//   t_cam,n   = trigger_n + stamp jitter          what the frame says
//   t_imu     = trigger_n + td + row phase * readout,   td that of the stamps (ScenarioConfig::calibration)
// Both jitters are normal, cut at 4 sigma. Frames are dropped after the tracker has seen them: the tracks run on, and
// nothing but the frame is missing.
#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include "core/measurements.h"
#include "core/random.h"
#include "sim/ground_truth.h"
#include "sim/trajectory.h"
#include "sim/world.h"

namespace plumbline::sim {

struct CameraRecording {
  std::vector<core::Frame> frames;
  std::map<std::int64_t, int> track_landmark;
  std::map<std::int64_t, int> track_segment;
  std::vector<LineEnds> line_ends;  // of every line observation, in their order
};

// The frames whose every row is exposed within [lead_s, duration_s - lead_s] but for the jitter. A frame holds the
// tracks of the last one that are still visible, then landmarks in their order up to points.per_frame. Visibility is
// decided on noise-free projections, so that the pixel noise is not truncated. Velocities are filled in where
// velocity_source is `exact`; finite differences are the tracker's (sim/track_velocity.h, sim/line_velocity.h). The
// segments are sim/line_sensor.h's.
CameraRecording simulate_camera(const Trajectory& trajectory, const World& world, const ScenarioConfig& config,
                                double lead_s, core::TrialId id);

}  // namespace plumbline::sim
