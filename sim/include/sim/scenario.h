// What a simulation is made of. Each field is a key of the YAML file, in the units of its name; configs/README.md
// documents them all.
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string_view>

#include <Eigen/Core>

#include "core/calibration.h"
#include "core/camera.h"
#include "core/config.h"
#include "core/error.h"
#include "core/state.h"

namespace plumbline::sim {

enum class TrajectoryType { kHandheld, kFigureEight, kCircle, kSpline };
inline constexpr std::array<std::string_view, 4> kTrajectoryTypeNames = {"handheld", "figure_eight", "circle",
                                                                         "spline"};

struct HandheldConfig {
  double speed_rms_m_s = 0.7;
  double rate_rms_rad_s = 0.6;
  double lowest_frequency_hz = 0.1;
  double highest_frequency_hz = 1.2;
};

struct LoopConfig {
  double radius_m = 2.0;
  double height_amplitude_m = 0.3;
  double period_s = 10.0;
};

struct TrajectoryConfig {
  TrajectoryType type = TrajectoryType::kHandheld;
  HandheldConfig handheld;
  LoopConfig loop;               // circle and figure_eight
  std::filesystem::path file;    // spline: poses T_W_B in TUM format
  double start_s = 0.0;          // spline: into the file
  double knot_interval_s = 0.1;  // spline: wider smooths more
  double largest_gap_s = 0.2;    // spline: a wider gap between poses is refused
};

struct ImuConfig {
  double rate_hz = 200.0;
  core::ImuNoise noise;
  Eigen::Vector3d gyro_bias_rad_s = Eigen::Vector3d::Zero();  // at the start
  Eigen::Vector3d accel_bias_m_s2 = Eigen::Vector3d::Zero();
};

struct CameraConfig {
  double rate_hz = 20.0;
  core::PinholeCamera model;
  double td_s = 0.0;
  core::RowReference td_reference_row = core::RowReference::kMiddle;
  double readout_s = 0.0;
  double pixel_sigma_px = 1.0;
  Eigen::Vector3d extrinsic_position_m{0.06, 0.02, -0.01};        // p_B_C
  Eigen::Vector4d extrinsic_rotation_xyzw{-0.5, 0.5, -0.5, 0.5};  // R_B_C: the camera looks along the body's x
};

enum class WorldType { kShell };
inline constexpr std::array<std::string_view, 1> kWorldTypeNames = {"shell"};

struct WorldConfig {
  WorldType type = WorldType::kShell;
  int landmarks = 4000;
  double nearest_m = 3.0;
  double farthest_m = 8.0;
};

struct PointsConfig {
  int per_frame = 100;
  double nearest_m = 0.5;
  double farthest_m = 15.0;
  double loss_probability = 0.0;
  int longest_track_frames = 0;
};

enum class PriorMeans { kDrawn, kTruth };
inline constexpr std::array<std::string_view, 2> kPriorMeansNames = {"drawn", "truth"};
enum class PriorStart { kMean, kDrawn };
inline constexpr std::array<std::string_view, 2> kPriorStartNames = {"mean", "drawn"};

struct PriorConfig {
  PriorMeans means = PriorMeans::kDrawn;
  PriorStart start = PriorStart::kMean;
  std::optional<double> td_mean_s;  // middle row; drawn where absent
  double td_sigma_s = 0.01;
  double readout_sigma_s = 0.005;
  double extrinsic_position_sigma_m = 0.02;
  double extrinsic_rotation_sigma_rad = 0.02;
  double position_sigma_m = 0.01;
  double orientation_sigma_rad = 0.01;
  double velocity_sigma_m_s = 0.05;
  double gyro_bias_sigma_rad_s = 0.005;
  double accel_bias_sigma_m_s2 = 0.05;

  core::StateSigmas state_sigmas() const;
  core::CalibrationSigmas calibration_sigmas() const;
};

struct ScenarioConfig {
  double duration_s = 15.0;
  double gravity_m_s2 = 9.81;
  TrajectoryConfig trajectory;
  ImuConfig imu;
  CameraConfig camera;
  WorldConfig world;
  PointsConfig points;
  PriorConfig prior;

  // The rig as it truly is, td of the middle row.
  core::RigCalibration calibration() const;
};

void visit(core::ConfigVisitor& v, ScenarioConfig& c);

// Rules that join several keys or elements; the key is relative to the scenario.
std::optional<core::RuleViolation> validate(const ScenarioConfig& c);

}  // namespace plumbline::sim
