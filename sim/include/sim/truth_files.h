// The truth of a dataset, in a folder of its own that an estimator is never given.
//   truth/mav0/state_groundtruth_estimate0/data.csv     EuRoC: stamp, p, q (w x y z), v, b_g, b_a at every IMU sample
//   truth/landmarks.csv, truth/tracks.csv, truth/calibration.yaml
//   truth/segments.csv, truth/line_tracks.csv, truth/line_ends.csv     where the world has segments
#pragma once

#include <filesystem>

#include "sim/ground_truth.h"

namespace plumbline::sim {

// `folder` is that of the dataset.
void write_truth(const std::filesystem::path& folder, const GroundTruth& truth);

// Throws core::DataError or core::ConfigError, `file:line: rule`.
GroundTruth read_truth(const std::filesystem::path& folder);

}  // namespace plumbline::sim
