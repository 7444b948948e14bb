#include "sim/trajectory_config.h"

#include <string>

#include "core/physical_ranges.h"

namespace plumbline::sim {

using core::any;
using core::between;
using core::positive_up_to;
using core::up_to;
using core::within;

namespace {

constexpr double kLeastFrequencyHz = 1e-6;
constexpr double kLeastPeriodS = 0.01;
constexpr double kMostPeriodS = 1e6;

}  // namespace

// Argument-dependent lookup finds these; it does not look into an unnamed namespace.
static void visit(core::ConfigVisitor& v, HandheldConfig& c) {
  v.value("speed_rms_m_s", c.speed_rms_m_s, up_to(core::kMostSpeedMS), "root mean square speed");
  v.value("rate_rms_rad_s", c.rate_rms_rad_s, up_to(core::kMostRateRadS),
          "root mean square angular rate; the peak is about 2.2 times");
  v.value("lowest_frequency_hz", c.lowest_frequency_hz, between(kLeastFrequencyHz, core::kMostFrequencyHz),
          "lower end of the band of its sinusoids");
  v.value("highest_frequency_hz", c.highest_frequency_hz, between(kLeastFrequencyHz, core::kMostFrequencyHz),
          "upper end");
}

static void visit(core::ConfigVisitor& v, ConstantMotionConfig& c) {
  v.value("rate_rad_s", c.rate_rad_s, within(core::kMostRateRadS), "angular rate, body axes");
  v.value("velocity_body_m_s", c.velocity_body_m_s, within(core::kMostSpeedMS),
          "`constant_twist`: velocity in body axes");
  v.value("velocity_m_s", c.velocity_m_s, within(core::kMostSpeedMS),
          "`constant_acceleration`: at the start, world axes");
  v.value("acceleration_m_s2", c.acceleration_m_s2, within(core::kMostAccelerationMS2),
          "`constant_acceleration`: world axes; with a rate of 0 constant in body axes too");
}

static void visit(core::ConfigVisitor& v, LoopConfig& c) {
  v.value("radius_m", c.radius_m, positive_up_to(core::kMostM),
          "of the circle, ball or torus; half the length of the figure eight");
  v.value("height_amplitude_m", c.height_amplitude_m, up_to(core::kMostM),
          "of the up and down of the circles and the figure eight, three times a loop");
  v.value("period_s", c.period_s, between(kLeastPeriodS, kMostPeriodS), "of one loop");
  v.value("waves", c.waves, between(1, 1000), "`wavy_circle`: ups and downs a loop");
  v.value("tube_radius_m", c.tube_radius_m, positive_up_to(core::kMostM), "`torus`: of its tube");
}

static void visit(core::ConfigVisitor& v, Sine3dConfig& c) {
  v.value("acceleration_m_s2", c.acceleration_m_s2, positive_up_to(core::kMostAccelerationMS2),
          "along the body's x axis");
  v.value("yaw_period_s", c.yaw_period_s, between(kLeastPeriodS, kMostPeriodS), "of a turn about the vertical");
  v.value("pitch_period_s", c.pitch_period_s, between(kLeastPeriodS, kMostPeriodS),
          "of a turn head over heels; not the yaw's");
}

static void visit_terms(core::ConfigVisitor& v, WaveConfig& c) {
  v.value("frequency_hz", c.frequency_hz, between(kLeastFrequencyHz, core::kMostFrequencyHz), "of each term");
  v.value("phase_rad", c.phase_rad, any(), "of each term at the start; none are zeros");
}

static void visit(core::ConfigVisitor& v, PositionWaveConfig& c) {
  v.value("offset_m", c.offset, within(core::kMostM), "mean");
  v.value("amplitude_m", c.amplitude, within(core::kMostM), "of each term");
  visit_terms(v, c);
}

static void visit(core::ConfigVisitor& v, AngleWaveConfig& c) {
  v.value("offset_rad", c.offset, within(core::kMostAngleRad), "mean");
  v.value("amplitude_rad", c.amplitude, within(core::kMostAngleRad), "of each term");
  visit_terms(v, c);
}

static void visit(core::ConfigVisitor& v, SinusoidsConfig& c) {
  v.section("x", c.x, "world axis x");
  v.section("y", c.y, "world axis y");
  v.section("z", c.z, "world axis z");
  v.section("yaw", c.yaw, "R = Rz(yaw) Ry(pitch) Rx(roll)");
  v.section("pitch", c.pitch, "about the turned y axis");
  v.section("roll", c.roll, "about the body's x axis");
}

void visit(core::ConfigVisitor& v, TrajectoryConfig& c) {
  v.choice("type", c.type, kTrajectoryTypeNames, "kind of motion: docs/trajectories.md");
  v.section(
      "handheld", c.handheld,
      "a random sum of sinusoids a seed: `handheld` in all six freedoms; `planar` in x, y and yaw; `one_axis` with "
      "one axis of rotation; `pure_translation`; `pure_rotation`");
  v.choice("rotation_axis", c.rotation_axis, kBodyAxisNames, "`one_axis`: the body axis that it turns about");
  v.section("constant", c.constant, "`constant_twist` and `constant_acceleration`");
  v.section("loop", c.loop,
            "`circle`, `wavy_circle`, `figure_eight`, `ball` and `torus`: travelled with the body's x axis ahead");
  v.section("sine3d", c.sine3d, "`sine3d`: turns in yaw and pitch while the body's acceleration stays the same");
  v.section("sinusoids", c.sinusoids, "`sinusoids`: sums of sinusoids of your own");
  v.path("file", c.file, "`spline`: recorded poses T_W_B");
  v.choice("format", c.format, core::kPoseFormatNames,
           "`spline`: of the file; `auto` tells by its first line: commas are EuRoC's, 12 numbers KITTI's");
  v.value("pose_rate_hz", c.pose_rate_hz, up_to(core::kMostFrequencyHz),
          "`spline`: poses a second of a KITTI file, which has no stamps");
  v.value("start_s", c.start_s, core::non_negative(),
          "`spline`: where in the file the recording starts, in the file's time");
  v.value("knot_interval_s", c.knot_interval_s, between(0.01, 100.0),
          "`spline`: wider smooths more, in the file's time; interpolated measurement noise would fake excitation");
  v.value("largest_gap_s", c.largest_gap_s, core::positive(), "`spline`: a wider one between poses is a gap");
  v.choice(
      "on_gap", c.on_gap, kOnGapNames,
      "`spline`: a gap within the used span is refused (start_s may choose another piece), or start_s counts from the "
      "longest piece of the file without one");
  v.value("speed_up", c.speed_up, between(1e-3, 1e3),
          "`spline`: the path travelled so many times faster; speed and rate grow as it, accelerations as its square");
}

namespace {

std::optional<core::RuleViolation> validate_wave(const std::string& key, const WaveConfig& c) {
  if (c.frequency_hz.size() != c.amplitude.size()) {
    return core::RuleViolation{key + ".frequency_hz", "must have as many numbers as the amplitude"};
  }
  if (!c.phase_rad.empty() && c.phase_rad.size() != c.amplitude.size()) {
    return core::RuleViolation{key + ".phase_rad", "must be empty, or have as many numbers as the amplitude"};
  }
  return std::nullopt;
}

std::optional<core::RuleViolation> validate_sinusoids(const SinusoidsConfig& c) {
  if (auto violation = validate_wave("x", c.x)) return violation;
  if (auto violation = validate_wave("y", c.y)) return violation;
  if (auto violation = validate_wave("z", c.z)) return violation;
  if (auto violation = validate_wave("yaw", c.yaw)) return violation;
  if (auto violation = validate_wave("pitch", c.pitch)) return violation;
  return validate_wave("roll", c.roll);
}

}  // namespace

std::optional<core::RuleViolation> validate(const TrajectoryConfig& c) {
  if (c.handheld.highest_frequency_hz < c.handheld.lowest_frequency_hz) {
    return core::RuleViolation{"handheld.highest_frequency_hz", "must be >= lowest_frequency_hz"};
  }
  if (c.type == TrajectoryType::kTorus && c.loop.tube_radius_m >= c.loop.radius_m) {
    return core::RuleViolation{"loop.tube_radius_m", "must be < radius_m"};
  }
  if (c.sine3d.yaw_period_s == c.sine3d.pitch_period_s) {
    return core::RuleViolation{"sine3d.pitch_period_s", "must differ from yaw_period_s, else the path drifts away"};
  }
  if (auto violation = validate_sinusoids(c.sinusoids)) {
    violation->key = "sinusoids." + violation->key;
    return violation;
  }
  if (c.type == TrajectoryType::kSpline && c.file.empty()) {
    return core::RuleViolation{"file", "a spline needs a pose file"};
  }
  if (c.type == TrajectoryType::kSpline &&
      (!std::filesystem::exists(c.file) || std::filesystem::is_directory(c.file))) {
    return core::RuleViolation{"file", "no such file: " + c.file.generic_string()};
  }
  if (c.format == core::PoseFormat::kKitti && c.pose_rate_hz == 0.0) {
    return core::RuleViolation{"pose_rate_hz", "a KITTI file has no stamps, so its rate must be given"};
  }
  return std::nullopt;
}

}  // namespace plumbline::sim
