// The truth of a trial. Only the evaluator sees it.
#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include <Eigen/Core>

#include "core/calibration.h"
#include "core/estimate.h"
#include "core/time.h"

namespace plumbline::sim {

struct GroundTruth {
  core::RigCalibration calibration;            // td of the middle row
  std::vector<core::StampedState> states;      // at every IMU sample's stamp, also of those that dropped out; sorted
  std::vector<Eigen::Vector3d> landmarks_W;    // [m]
  std::map<std::int64_t, int> track_landmark;  // the landmark that a track sees
};

// The true state at an IMU clock time within the recording: exact at the stamp of an IMU sample, else interpolated
// between the two neighbours (position and velocity and biases linearly, orientation by SLERP).
// Throws core::DataError outside the recording.
core::State state_at(const GroundTruth& truth, core::TimeNs t_ns);

}  // namespace plumbline::sim
