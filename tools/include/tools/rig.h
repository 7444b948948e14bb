// A rig as the configuration files of other programs state it, in our conventions: td of the middle row, T_B_C, and
// continuous-time densities. Each format has a writer and a reader; what a format turns round stands in its files, too.
//
//   format     extrinsics                   td                           readout              noise
//   kalibr     T_cam_imu = T_B_C^-1         timeshift_cam_imu            line_delay [s/row]   densities
//                                           of the first row where there is a line_delay
//   openvins   T_imu_cam = T_B_C            timeshift_cam_imu, middle    line_delay, unread   densities
//   vins       extrinsicRotation, ~         td, middle                   rolling_shutter_tr   density * sqrt(rate)
//              Translation = T_B_C          td_first = td - readout/2    = readout
//   euroc      T_BS = T_B_C                 as kalibr, keys of our own                        densities
// All have t_imu = t_cam + td. Sources: Kalibr's wiki (yaml-formats); OpenVINS, config/; VINS-Mono, config/euroc and
// projection_td_factor.cpp; Burri et al., "The EuRoC micro aerial vehicle datasets", IJRR 2016.
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string_view>
#include <vector>

#include "core/calibration.h"
#include "core/measurements.h"

namespace plumbline::tools {

enum class RigFormat { kKalibr, kOpenvins, kVins, kEuroc };

struct Rig {
  core::PinholeCamera camera;
  core::RigCalibration calibration;
  core::ImuNoise imu_noise;
  double imu_rate_hz = 0.0;
  double camera_rate_hz = 0.0;
  double gravity_m_s2 = 0.0;
  double pixel_sigma_px = 0.0;
};

// The same from files, each of which states a part.
struct PartialRig {
  std::optional<core::PinholeCamera> camera;
  std::optional<core::RigCalibration> calibration;
  std::optional<core::ImuNoise> imu_noise;
  std::optional<double> imu_rate_hz;
  std::optional<double> camera_rate_hz;
  std::optional<double> gravity_m_s2;
  std::optional<double> pixel_sigma_px;
};

// What a recording's estimator is told beforehand; the rates are the medians of its stamps.
Rig rig_of(const core::MeasurementLog& log);

// Into a folder that exists.
void write_rig(const std::filesystem::path& folder, const Rig& rig, RigFormat format);

// Adds what the file or EuRoC folder states; its format shows in its keys. imu_rate_hz is for files whose noise depends
// on it without their saying it. Throws core::DataError or core::ConfigError `file:line: key: rule`; also where the rig
// has it already.
void read_rig(const std::filesystem::path& path, std::optional<double> imu_rate_hz, PartialRig& rig);

}  // namespace plumbline::tools
