// How to estimate. Each field is a key of the YAML file; configs/README.md documents them all.
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "core/calibration.h"
#include "core/config.h"
#include "estimator/factors/landmark.h"
#include "estimator/factors/ray_chart.h"

namespace plumbline::estimator {

enum class EstimatorType { kBatch, kSlidingWindow, kInitialisation, kExternal };
inline constexpr std::array<std::string_view, 4> kEstimatorTypeNames = {"batch", "sliding_window", "initialisation",
                                                                        "external"};
enum class TimingModel { kPropagated, kFeatureVelocity, kSpline };
inline constexpr std::array<std::string_view, 3> kTimingModelNames = {"propagated", "feature_velocity", "spline"};
enum class Initialisation { kPrior, kFromScratch };
inline constexpr std::array<std::string_view, 2> kInitialisationNames = {"prior", "from_scratch"};
enum class Solver { kSchur, kCeres };
inline constexpr std::array<std::string_view, 2> kSolverNames = {"schur", "ceres"};
enum class RobustLoss { kNone, kHuber, kCauchy };
inline constexpr std::array<std::string_view, 3> kRobustLossNames = {"none", "huber", "cauchy"};

// Which observations enter.
enum class ObservationUse { kPointsAndLines, kPoints, kLines };
inline constexpr std::array<std::string_view, 3> kObservationUseNames = {"points_and_lines", "points", "lines"};
inline bool uses_points(ObservationUse use) { return use != ObservationUse::kLines; }
inline bool uses_lines(ObservationUse use) { return use != ObservationUse::kPoints; }

// The estimator's own belief of the IMU's noise; the data sheet's where absent.
struct ImuNoiseOverride {
  std::optional<double> gyro_noise_density;
  std::optional<double> gyro_bias_walk;
  std::optional<double> accel_noise_density;
  std::optional<double> accel_bias_walk;
};

// What is free; the rest is held at the prior's mean.
struct EstimateWhat {
  bool td = true;
  bool readout = true;
  bool extrinsics = true;
  bool intrinsics = false;
};

// When a line is estimated at all (estimator/line_triangulation.h) and when it is given up.
struct LineRules {
  double largest_depth_sigma = 0.3;
  double cull_sigma = 8.0;
};

// Of the timing `spline`.
struct SplineConfig {
  std::optional<double> knot_spacing_s;
  int order = 6;
};

// Of `sliding_window`.
struct WindowConfig {
  int keyframes = 10;
  int kept_points = 40;
  double freeze_td_sigma_s = 1e-3;
  int start_keyframes = 40;
  double keyframe_parallax_px = 2.0;
  double largest_depth_sigma = 0.2;
  double usual_depth_m = 5.0;
  double outlier_sigma = 5.0;
  int restarts = 0;
};

// Of `initialisation: from_scratch` (estimator/from_scratch.h).
struct FromScratchConfig {
  double longest_s = 3.0;
  double least_parallax_px = 10.0;
  double largest_scale_sigma = 0.05;
  double gyro_bias_sigma_rad_s = 0.05;
  double accel_bias_sigma_m_s2 = 0.2;
};

// Of `external`: a program that is given the dataset (docs/interoperability.md). None of the other keys is its.
struct ExternalConfig {
  std::filesystem::path command;
  std::string arguments;
  std::string environment;
  double cpu_limit_s = 600.0;
  double memory_limit_mb = 4096.0;
};

struct EstimatorConfig {
  EstimatorType type = EstimatorType::kBatch;
  ObservationUse use = ObservationUse::kPointsAndLines;
  TimingModel timing = TimingModel::kPropagated;
  ResidualType residual = ResidualType::kPinhole;
  LandmarkType landmark = LandmarkType::kBearingInverseDepth;
  Initialisation initialisation = Initialisation::kPrior;
  Solver solver = Solver::kSchur;
  double keyframe_rate_hz = 10.0;
  std::optional<double> pixel_sigma_px;
  std::optional<double> line_sigma_px;
  RobustLoss loss = RobustLoss::kNone;
  double loss_scale = 2.0;
  std::optional<double> state_td_s;
  ImuNoiseOverride imu;
  EstimateWhat estimate;
  LineRules lines;
  SplineConfig spline;
  WindowConfig window;
  FromScratchConfig from_scratch;
  ExternalConfig external;
  int max_iterations = 50;
  double max_cost_per_dof = 2.0;
};

inline bool starts_from_scratch(const EstimatorConfig& config) {
  return config.initialisation == Initialisation::kFromScratch || config.type == EstimatorType::kInitialisation;
}

void visit(core::ConfigVisitor& v, EstimatorConfig& c);

// The noise that the estimator believes in: its own where given, else the data sheet's.
struct BelievedNoise {
  core::ImuNoise imu;
  double pixel_sigma_px = 0.0;
  double line_sigma_px = 0.0;
};
BelievedNoise believed_noise(const EstimatorConfig& config, const core::ImuNoise& imu_noise, double pixel_sigma_px,
                             double line_sigma_px);

}  // namespace plumbline::estimator
