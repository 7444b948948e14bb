// Trajectories to be compared, from files of other programs or of our own.
//   an estimate   a pose file (TUM, TUM with covariance, EuRoC and VINS CSV, OpenVINS's total state), or a folder with
//                 estimate.tum, meta.yaml and perhaps td.csv (tools/stated_estimate.h)
//   a truth       a pose file, or a dataset with its truth
// Poses come back in the IMU clock. meta.yaml states `stamp_clock: imu | camera`; stamps of the camera's clock are
// moved by the estimate's own `td_s` (or `calibration.td_s`), t_imu = t_cam + td: that is the instant it claims the
// pose for, whichever row its td speaks of, and an error of td costs it speed times that error. Without meta.yaml the
// stamps are taken as those of the truth.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/estimate.h"
#include "core/pose_covariance_file.h"
#include "core/pose_file.h"

namespace plumbline::tools {

struct EstimatedTrajectory {
  std::vector<core::StampedPose> poses;           // may be unusable (core::PoseFileOptions)
  std::vector<core::PoseCovariance> covariances;  // one a pose, or none
  std::string stamp_clock = "undeclared";         // or imu, camera
  std::optional<double> td_s;                     // what stamps of the camera's clock were moved by
  std::optional<core::TimeOffsetEstimate> td;     // the last estimate, middle row; where one is stated
  std::vector<core::TimeOffsetEstimate> td_history;
};

// What the files do not say themselves.
struct EstimateHints {
  std::optional<std::filesystem::path> deviations;  // beside OpenVINS's states
  std::optional<double> td_s;                       // the stamps are the camera's, and this is the estimated td
};

struct TrueTrajectory {
  std::vector<core::StampedPose> poses;
  std::optional<double> td_s;  // of a dataset, middle row
};

// Throws core::DataError or core::ConfigError for what cannot be read.
EstimatedTrajectory read_estimate(const std::filesystem::path& path, const EstimateHints& hints = {});
TrueTrajectory read_true_trajectory(const std::filesystem::path& path);

struct EstimatedRun {
  std::string name;  // of the folder, or of the file without its ending
  std::filesystem::path path;
};

// The estimates in a folder that is none itself: its folders with an estimate.tum and its pose files (.tum, .txt,
// .csv), by name. Throws core::DataError where there is none or two have the same name.
std::vector<EstimatedRun> list_estimates(const std::filesystem::path& folder);

// `truth` itself where it is a file or a dataset, else the pose file or dataset in it that has the run's name. Throws
// core::DataError where there is none.
std::filesystem::path truth_of(const EstimatedRun& run, const std::filesystem::path& truth);

}  // namespace plumbline::tools
