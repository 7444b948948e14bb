// The keys of scenario.prior: what the estimator is told beforehand.
#pragma once

#include <array>
#include <optional>
#include <string_view>

#include "core/config.h"
#include "core/state.h"

namespace plumbline::sim {

enum class PriorMeans { kDrawn, kTruth };
inline constexpr std::array<std::string_view, 2> kPriorMeansNames = {"drawn", "truth"};
enum class PriorStart { kMean, kDrawn };
inline constexpr std::array<std::string_view, 2> kPriorStartNames = {"mean", "drawn"};

struct PriorConfig {
  PriorMeans means = PriorMeans::kDrawn;
  PriorStart start = PriorStart::kMean;
  std::optional<double> td_mean_s;       // middle row; drawn where absent
  std::optional<double> readout_mean_s;  // likewise
  double td_sigma_s = 0.01;
  double readout_sigma_s = 0.005;
  double extrinsic_position_sigma_m = 0.02;
  double extrinsic_rotation_sigma_rad = 0.02;
  double focal_sigma_px = 0.0;  // 0 both: the camera is known
  double principal_point_sigma_px = 0.0;
  double position_sigma_m = 0.01;
  double orientation_sigma_rad = 0.01;
  double velocity_sigma_m_s = 0.05;
  double gyro_bias_sigma_rad_s = 0.005;
  double accel_bias_sigma_m_s2 = 0.05;

  core::StateSigmas state_sigmas() const;
  core::CalibrationSigmas calibration_sigmas() const;
};

void visit(core::ConfigVisitor& v, PriorConfig& c);

}  // namespace plumbline::sim
