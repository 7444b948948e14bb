// The keys of scenario.trajectory: how the body moves.
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string_view>

#include "core/config.h"
#include "core/error.h"

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

void visit(core::ConfigVisitor& v, TrajectoryConfig& c);
std::optional<core::RuleViolation> validate(const TrajectoryConfig& c);

}  // namespace plumbline::sim
