// The files that OpenVINS saves its total state to (save_total_state), a line an instant, blanks between:
//   states       timestamp_s  qx qy qz qw  px py pz  v(3) b_g(3) b_a(3)  td  ...
//   deviations   timestamp_s  theta(3)     p(3)      v(3) b_g(3) b_a(3)  td  ...
// Stamps are the IMU's clock already, t_cam + td. Its JPL quaternion of R_I_G has the numbers of the Hamilton one of
// R_G_I, which is T_W_B's. Its orientation's error is the body's, as ours, but for the sign.
#pragma once

#include <filesystem>
#include <vector>

#include "core/estimate.h"
#include "core/pose_covariance_file.h"
#include "core/pose_file.h"

namespace plumbline::tools {

struct OpenvinsStates {
  std::vector<core::StampedPose> poses;  // may be unusable (core::PoseFileOptions)
  std::vector<core::TimeOffsetEstimate> td;
  std::vector<core::PoseCovariance> covariances;  // diagonal; none without deviations
};

// Told by the comment in its first line.
bool is_openvins_states(const std::filesystem::path& file);

// Both throw core::DataError `file:line: rule`.
OpenvinsStates read_openvins_states(const std::filesystem::path& file);
void add_openvins_deviations(const std::filesystem::path& file, OpenvinsStates& states);

}  // namespace plumbline::tools
