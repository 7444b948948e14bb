// The keys of scenario.camera and scenario.points: the camera, how it is mounted, and what it tracks.
#pragma once

#include <array>
#include <optional>
#include <string_view>

#include <Eigen/Core>

#include "core/calibration.h"
#include "core/camera.h"
#include "core/config.h"
#include "core/error.h"

namespace plumbline::sim {

// What a frame's stamp refers to, of the exposure of its middle row.
enum class ExposureStamp { kMiddle, kStart };
inline constexpr std::array<std::string_view, 2> kExposureStampNames = {"middle", "start"};

struct CameraConfig {
  double rate_hz = 20.0;
  core::PinholeCamera model;
  double td_s = 0.0;
  core::RowReference td_reference_row = core::RowReference::kMiddle;
  double readout_s = 0.0;
  double exposure_s = 0.0;
  ExposureStamp exposure_stamp = ExposureStamp::kMiddle;
  double trigger_jitter_s = 0.0;
  double stamp_jitter_s = 0.0;
  double drop_probability = 0.0;
  double pixel_sigma_px = 1.0;
  std::optional<double> pixel_noise_dof;  // of Student's t; normal where absent
  double pixel_noise_correlation = 0.0;   // from frame to frame of a track
  double gross_outlier_probability = 0.0;
  double gross_outlier_sigma_px = 50.0;
  double uniform_outlier_probability = 0.0;
  Eigen::Vector3d extrinsic_position_m{0.06, 0.02, -0.01};        // p_B_C
  Eigen::Vector4d extrinsic_rotation_xyzw{-0.5, 0.5, -0.5, 0.5};  // R_B_C: the camera looks along the body's x
};

void visit(core::ConfigVisitor& v, CameraConfig& c);
std::optional<core::RuleViolation> validate(const CameraConfig& c);

// Where the image velocities of the observations come from.
enum class VelocitySource { kFiniteDifference, kExact, kNone };
inline constexpr std::array<std::string_view, 3> kVelocitySourceNames = {"finite_difference", "exact", "none"};

struct PointsConfig {
  int per_frame = 100;
  double nearest_m = 0.5;
  double farthest_m = 15.0;
  double loss_probability = 0.0;
  int longest_track_frames = 0;
  VelocitySource velocity_source = VelocitySource::kFiniteDifference;
};

void visit(core::ConfigVisitor& v, PointsConfig& c);
std::optional<core::RuleViolation> validate(const PointsConfig& c);

}  // namespace plumbline::sim
