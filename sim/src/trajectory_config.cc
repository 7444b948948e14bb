#include "sim/trajectory_config.h"

namespace plumbline::sim {

using core::non_negative;
using core::positive;

// Argument-dependent lookup finds these; it does not look into an unnamed namespace.
static void visit(core::ConfigVisitor& v, HandheldConfig& c) {
  v.value("speed_rms_m_s", c.speed_rms_m_s, non_negative(), "root mean square speed");
  v.value("rate_rms_rad_s", c.rate_rms_rad_s, non_negative(),
          "root mean square angular rate; the peak is about 2.2 times");
  v.value("lowest_frequency_hz", c.lowest_frequency_hz, positive(), "lower end of the band of its sinusoids");
  v.value("highest_frequency_hz", c.highest_frequency_hz, positive(), "upper end");
}

static void visit(core::ConfigVisitor& v, LoopConfig& c) {
  v.value("radius_m", c.radius_m, positive(), "of the circle; half the length of the figure eight");
  v.value("height_amplitude_m", c.height_amplitude_m, non_negative(), "of the up and down, three times a loop");
  v.value("period_s", c.period_s, positive(), "of one loop");
}

void visit(core::ConfigVisitor& v, TrajectoryConfig& c) {
  v.choice("type", c.type, kTrajectoryTypeNames, "kind of motion");
  v.section("handheld", c.handheld, "`handheld`: a random sum of sinusoids a seed");
  v.section("loop", c.loop, "`circle` and `figure_eight`: travelled with the body's x axis ahead");
  v.path("file", c.file, "`spline`: recorded poses T_W_B, TUM format");
  v.value("start_s", c.start_s, non_negative(), "`spline`: where in the file the recording starts");
  v.value("knot_interval_s", c.knot_interval_s, core::at_least(0.01),
          "`spline`: wider smooths more; interpolated measurement noise would fake excitation");
  v.value("largest_gap_s", c.largest_gap_s, positive(), "`spline`: a wider gap between poses is refused");
}

std::optional<core::RuleViolation> validate(const TrajectoryConfig& c) {
  if (c.handheld.highest_frequency_hz < c.handheld.lowest_frequency_hz) {
    return core::RuleViolation{"handheld.highest_frequency_hz", "must be >= lowest_frequency_hz"};
  }
  if (c.type == TrajectoryType::kSpline && c.file.empty()) {
    return core::RuleViolation{"file", "a spline needs a pose file"};
  }
  if (c.type == TrajectoryType::kSpline &&
      (!std::filesystem::exists(c.file) || std::filesystem::is_directory(c.file))) {
    return core::RuleViolation{"file", "no such file: " + c.file.generic_string()};
  }
  return std::nullopt;
}

}  // namespace plumbline::sim
