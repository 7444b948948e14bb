// The keys of scenario.trajectory: how the body moves. docs/trajectories.md has the equation of each type.
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "core/config.h"
#include "core/error.h"
#include "core/pose_formats.h"

namespace plumbline::sim {

enum class TrajectoryType {
  kHandheld,
  kPlanar,
  kOneAxis,
  kPureTranslation,
  kPureRotation,
  kStatic,
  kConstantTwist,
  kConstantAcceleration,
  kCircle,
  kWavyCircle,
  kFigureEight,
  kBall,
  kTorus,
  kSine3d,
  kSinusoids,
  kSpline
};
inline constexpr std::array<std::string_view, 16> kTrajectoryTypeNames = {
    "handheld",      "planar",      "one_axis",       "pure_translation",
    "pure_rotation", "static",      "constant_twist", "constant_acceleration",
    "circle",        "wavy_circle", "figure_eight",   "ball",
    "torus",         "sine3d",      "sinusoids",      "spline"};

struct HandheldConfig {
  double speed_rms_m_s = 0.7;
  double rate_rms_rad_s = 0.6;
  double lowest_frequency_hz = 0.1;
  double highest_frequency_hz = 1.2;
};

enum class BodyAxis { kX, kY, kZ };
inline constexpr std::array<std::string_view, 3> kBodyAxisNames = {"x", "y", "z"};

struct ConstantMotionConfig {
  Eigen::Vector3d rate_rad_s{0.10, -0.15, 0.35};           // of the body, body axes
  Eigen::Vector3d velocity_body_m_s{0.5, 0.1, 0.1};        // constant_twist: body axes
  Eigen::Vector3d velocity_m_s{-0.4, 0.2, 0.1};            // constant_acceleration: at the start, world axes
  Eigen::Vector3d acceleration_m_s2{0.05, -0.03, -0.015};  // constant_acceleration: world axes
};

struct LoopConfig {
  double radius_m = 2.0;
  double height_amplitude_m = 0.3;
  double period_s = 10.0;
  int waves = 10;              // wavy_circle
  double tube_radius_m = 0.6;  // torus
};

struct Sine3dConfig {
  double acceleration_m_s2 = 0.5;
  double yaw_period_s = 7.0;
  double pitch_period_s = 11.0;
};

// offset + sum_i amplitude_i sin(2 pi frequency_i t + phase_i); no phases are phases of 0.
struct WaveConfig {
  double offset = 0.0;
  std::vector<double> amplitude;
  std::vector<double> frequency_hz;
  std::vector<double> phase_rad;
};
struct PositionWaveConfig : WaveConfig {};  // m
struct AngleWaveConfig : WaveConfig {};     // rad

struct SinusoidsConfig {
  PositionWaveConfig x, y, z;
  AngleWaveConfig yaw, pitch, roll;
};

enum class OnGap { kRefuse, kLongestSegment };
inline constexpr std::array<std::string_view, 2> kOnGapNames = {"refuse", "longest_segment"};

struct TrajectoryConfig {
  TrajectoryType type = TrajectoryType::kHandheld;
  HandheldConfig handheld;
  BodyAxis rotation_axis = BodyAxis::kZ;
  ConstantMotionConfig constant;
  LoopConfig loop;
  Sine3dConfig sine3d;
  SinusoidsConfig sinusoids;

  // The spline's.
  std::filesystem::path file;
  core::PoseFormat format = core::PoseFormat::kAuto;
  double pose_rate_hz = 0.0;  // KITTI: poses a second
  double start_s = 0.0;
  double knot_interval_s = 0.1;
  double largest_gap_s = 0.2;
  OnGap on_gap = OnGap::kRefuse;
  double speed_up = 1.0;
};

void visit(core::ConfigVisitor& v, TrajectoryConfig& c);
std::optional<core::RuleViolation> validate(const TrajectoryConfig& c);

}  // namespace plumbline::sim
