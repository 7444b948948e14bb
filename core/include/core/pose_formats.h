// Recorded poses in the formats that data sets use.
//   tum     timestamp_s tx ty tz qx qy qz qw                          blanks between (core/pose_file.h)
//   euroc   timestamp_ns,px,py,pz,qw,qx,qy,qz[,more columns][,]       integer stamps, w first, commas between
//   kitti   r11 r12 r13 tx r21 r22 r23 ty r31 r32 r33 tz              camera to first camera, row by row, no stamps
// EuRoC's is that of its ground truth, of exported poses without velocity and biases, and of VINS with its comma at the
// end of the line. KITTI's axes are a camera's, x right, y down, z forward, for world and body alike; the poses that
// are returned have x forward, y left, z up for both, so that gravity points down: T_W_B = M T M^-1.
#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "core/pose_file.h"

namespace plumbline::core {

// By the first line that is no comment: commas are EuRoC's, 12 numbers KITTI's unless the file's name ends in .tum, all
// else TUM's.
enum class PoseFormat { kAuto, kTum, kEuroc, kKitti };
inline constexpr std::array<std::string_view, 4> kPoseFormatNames = {"auto", "tum", "euroc", "kitti"};

struct PoseFile {
  std::vector<StampedPose> poses;
  PoseFormat format = PoseFormat::kTum;  // what it is, never kAuto
};

struct PoseFormatOptions {
  PoseFormat format = PoseFormat::kAuto;
  double kitti_rate_hz = 0.0;   // row i is stamped i / rate; KITTI files are refused where it is 0
  bool allow_unusable = false;  // as in PoseFileOptions; not for KITTI
};

// Throws DataError `file:line: rule` as read_tum does, and for a KITTI rotation that is not one to 1e-3.
PoseFile read_poses(const std::filesystem::path& path, const PoseFormatOptions& options = {});
PoseFile parse_poses(std::string_view text, const std::string& name, const PoseFormatOptions& options = {});

}  // namespace plumbline::core
