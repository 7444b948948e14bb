// The formats of tools/rig.h, one source each.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "core/config_tree.h"
#include "core/error.h"
#include "tools/rig.h"

namespace plumbline::tools::rig_formats {

// Of a file's name and content.
struct TextFile {
  std::filesystem::path name;
  std::string text;
};

std::vector<TextFile> kalibr_files(const Rig& rig);
std::vector<TextFile> openvins_files(const Rig& rig);
std::vector<TextFile> vins_files(const Rig& rig);
std::vector<TextFile> euroc_files(const Rig& rig);

// Each adds what the tree states; the trees are told apart by their keys (rig.cc).
void read_camchain(const core::ConfigTree& tree, PartialRig& rig);  // cam0, of Kalibr and OpenVINS
void read_imu(const core::ConfigTree& tree, PartialRig& rig);       // imu0 or bare, of Kalibr and OpenVINS
void read_openvins(const core::ConfigTree& tree, const std::filesystem::path& folder, PartialRig& rig);
void read_vins(const core::ConfigTree& tree, const std::filesystem::path& folder, std::optional<double> imu_rate_hz,
               PartialRig& rig);
void read_euroc_sensor(const core::ConfigTree& tree, PartialRig& rig);

// What Kalibr's and EuRoC's files share, with the keys of either.
std::string densities_text(const core::ImuNoise& noise, std::string_view indent);
core::ImuNoise parse_densities(const core::ConfigTree& tree);
core::PinholeCamera parse_pinhole(const core::ConfigTree& cam, std::string_view coefficients_key);
// td and readout: timeshift_cam_imu, of the first row unless timeshift_reference_row says middle, and line_delay.
core::RigCalibration parse_timing(const core::ConfigTree& cam, const core::Pose& T_B_C, int rows);
// The line_delay's line and its end, or nothing for a global shutter; td of the first row.
std::string line_delay_text(const core::RigCalibration& calibration, int rows, std::string_view indent);
double td_first_row(const core::RigCalibration& calibration);

// [a, b, ...] in the shortest form that reads back to the bit.
template <class Numbers>
std::string list(const Numbers& numbers) {
  return fmt::format("[{}]", fmt::join(numbers.begin(), numbers.end(), ", "));
}
// Each element the nearest double, so that the quaternion comes back to 15 decimals.
Eigen::Matrix3d rotation_matrix(const Eigen::Quaterniond& q);
// The rows of the 4 x 4 matrix, each as a list.
std::vector<std::string> rows_of(const core::Pose& T);

template <class T>
void set_once(std::optional<T>& slot, T value, const core::ConfigTree& tree, std::string_view what) {
  if (slot) throw core::config_error(tree.origin, "", fmt::format("another file states {} already", what));
  slot = std::move(value);
}

}  // namespace plumbline::tools::rig_formats
