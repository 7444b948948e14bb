// The folder of an estimate, by whichever program:
//   estimate.tum    T_W_B, perhaps with 21 further columns of covariance (core/pose_covariance_file.h)
//   meta.yaml       stamp_clock, status, reason, td_s, td_sigma_s, td_reference_row, readout_s, T_B_C, covariance;
//                   calibration.KEY will do for td_s, readout_s and T_B_C. Other keys are the program's own.
//   td.csv          t_ns,td_s[,sigma_s]: what it knew of td at that instant; in the clock and of the row of the others
// docs/interoperability.md has the keys one by one.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/calibration.h"
#include "core/estimate.h"

namespace plumbline::tools {

struct EstimateMeta {
  std::string stamp_clock;  // imu or camera
  core::SolveStatus status = core::SolveStatus::kConverged;
  std::string reason;
  std::optional<core::RowReference> td_reference_row;
  std::optional<double> td_s;  // of that row
  std::optional<double> td_sigma_s;
  std::optional<double> readout_s;
  std::optional<core::Pose> T_B_C;
  std::optional<core::PosteriorCovariance> covariance;  // td of the middle row
};

// Throws core::ConfigError, `file:line: key: rule`.
EstimateMeta read_estimate_meta(const std::filesystem::path& file);

// td.csv, in the IMU clock and of the middle row. Throws core::DataError `file:line: rule`.
std::vector<core::TimeOffsetEstimate> read_td_history(const std::filesystem::path& file, const EstimateMeta& meta);

// As an estimator's own answer. Velocities and biases are none of the files'; they are zero, as is the covariance of
// what is stated without one.
struct StatedEstimate {
  core::EstimateLog log;
  bool td = false;
  bool readout = false;
  bool extrinsics = false;
};

// Throws core::DataError or core::ConfigError; also where td is stated without its row.
StatedEstimate read_stated_estimate(const std::filesystem::path& folder);

}  // namespace plumbline::tools
