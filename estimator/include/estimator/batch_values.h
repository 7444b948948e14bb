// What a batch estimate is made from, and what it has found so far.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "core/calibration.h"
#include "core/measurements.h"
#include "core/state.h"
#include "estimator/config.h"
#include "estimator/factors/orthonormal_line.h"
#include "estimator/factors/parameter_blocks.h"
#include "estimator/factors/spline_factors.h"
#include "estimator/keyframes.h"

namespace plumbline::estimator {

// What stays the same while the estimate grows.
struct BatchInput {
  const core::MeasurementLog& log;
  const EstimatorConfig& config;
  BelievedNoise noise;
  std::vector<std::size_t> keyframes;  // indices of frames
  std::vector<Track> tracks;
  std::vector<LineTrack> line_tracks = {};
};

// A line about the constant origin that it was given with its first value.
struct LineValue {
  Eigen::Vector3d origin_W;
  LineBlock block;
};

// The unknowns of camera timing `spline` (trajectory_spline.h).
struct TrajectorySpline {
  SplineKnots knots;
  std::size_t first_sample = 0;  // of the IMU, at the spline's origin
  std::size_t last_sample = 0;   // at its end
  std::vector<PoseBlock> controls = {};
  double bias_interval_s = 0.0;
  std::vector<BiasBlock> biases = {};

  SplineInstant at(const core::MeasurementLog& log, core::TimeNs t_ns) const;
  double seconds(const core::MeasurementLog& log, core::TimeNs t_ns) const {
    return core::to_seconds(t_ns - log.imu[first_sample].t_ns);
  }
};

// State 0 is the prior's, state k + 1 that of keyframe k.
struct BatchValues {
  core::RigCalibration calibration;
  std::vector<std::size_t> samples;  // the IMU sample of each state
  std::vector<core::State> states;
  std::vector<std::optional<Eigen::Vector3d>> landmarks;  // (x, y, lambda) a track
  std::vector<std::optional<LineValue>> lines = {};       // a line track
  std::vector<bool> culled_lines = {};                    // line tracks that have been given up
  std::optional<TrajectorySpline> spline = std::nullopt;  // where it is what is estimated; the states are on it

  void forget_landmarks();
};

}  // namespace plumbline::estimator
