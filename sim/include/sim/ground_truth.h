// The truth of a trial. Only the evaluator sees it.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <vector>

#include <Eigen/Core>

#include "core/calibration.h"
#include "core/estimate.h"
#include "core/time.h"
#include "sim/segment.h"

namespace plumbline::sim {

// What a line observation is of.
struct LineEnds {
  core::TimeNs frame_ns = 0;  // the stamp of its frame, camera clock
  std::int64_t track_id = 0;
  int segment = 0;                             // another than the track's where the match is wrong
  std::array<double, 2> t_imu_s = {0.0, 0.0};  // when the rows of its ends were exposed
  std::array<Eigen::Vector2d, 2> ends_px = {Eigen::Vector2d::Zero(), Eigen::Vector2d::Zero()};  // without noise
};

struct GroundTruth {
  core::RigCalibration calibration;            // td of the middle row
  std::vector<core::StampedState> states;      // at every IMU sample's stamp, also of those that dropped out; sorted
  std::vector<Eigen::Vector3d> landmarks_W;    // [m]
  std::map<std::int64_t, int> track_landmark;  // the landmark that a track sees
  std::vector<Segment> segments_W;
  std::map<std::int64_t, int> track_segment;  // the segment that a line track sees
  std::vector<LineEnds> line_ends;            // of every line observation, in their order
};

// The true state at an IMU clock time within the recording: exact at the stamp of an IMU sample, else interpolated
// between the two neighbours (position and velocity and biases linearly, orientation by SLERP).
// Throws core::DataError outside the recording.
core::State state_at(const GroundTruth& truth, core::TimeNs t_ns);

}  // namespace plumbline::sim
