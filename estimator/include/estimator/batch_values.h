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

// State 0 is the prior's, state k + 1 that of keyframe k.
struct BatchValues {
  core::RigCalibration calibration;
  std::vector<std::size_t> samples;  // the IMU sample of each state
  std::vector<core::State> states;
  std::vector<std::optional<Eigen::Vector3d>> landmarks;  // (x, y, lambda) a track
  std::vector<std::optional<LineValue>> lines = {};       // a line track
  std::vector<bool> culled_lines = {};                    // line tracks that have been given up

  void forget_landmarks();
};

}  // namespace plumbline::estimator
