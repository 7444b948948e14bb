#include "sim/handheld_motion.h"

#include <cmath>
#include <numbers>

namespace plumbline::sim {
namespace {

enum Channel : std::uint64_t { kX, kY, kZ, kYaw, kPitch, kRoll };

// The sum of a freedom with the given rms rate of change. One band a term, equal steps of log frequency, so that no
// two terms beat slowly against each other; each term has the same share of the rms rate.
SinusoidSum drawn_sum(const HandheldConfig& config, core::TrialId id, Channel channel, double rate_rms) {
  constexpr int kTerms = 5;
  constexpr double kTwoPi = 2.0 * std::numbers::pi;
  const core::RandomStream stream(id.shared(), "trajectory/handheld");
  const double ratio = config.highest_frequency_hz / config.lowest_frequency_hz;
  SinusoidSum sum;
  for (int k = 0; k < kTerms; ++k) {
    const auto u = stream.uniforms(channel, static_cast<std::uint64_t>(k));
    const double omega = kTwoPi * config.lowest_frequency_hz * std::pow(ratio, (k + u[0]) / kTerms);
    sum.terms.push_back(
        {.amplitude = rate_rms * std::sqrt(2.0 / kTerms) / omega, .omega_rad_s = omega, .phase_rad = kTwoPi * u[1]});
  }
  return sum;
}

}  // namespace

HarmonicTrajectory::Shape handheld_shape(const HandheldConfig& config, core::TrialId id) {
  HarmonicTrajectory::Shape shape = pure_translation_shape(config, id);
  const HarmonicTrajectory::Shape rotation = pure_rotation_shape(config, id);
  shape.yaw = rotation.yaw;
  shape.pitch = rotation.pitch;
  shape.roll = rotation.roll;
  return shape;
}

HarmonicTrajectory::Shape planar_shape(const HandheldConfig& config, core::TrialId id) {
  const double speed = config.speed_rms_m_s / std::sqrt(2.0);
  HarmonicTrajectory::Shape shape;
  shape.position[0] = drawn_sum(config, id, kX, speed);
  shape.position[1] = drawn_sum(config, id, kY, speed);
  shape.yaw = drawn_sum(config, id, kYaw, config.rate_rms_rad_s);
  return shape;
}

HarmonicTrajectory::Shape one_axis_shape(const HandheldConfig& config, BodyAxis axis, core::TrialId id) {
  HarmonicTrajectory::Shape shape = pure_translation_shape(config, id);
  switch (axis) {
    case BodyAxis::kX:
      shape.roll = drawn_sum(config, id, kRoll, config.rate_rms_rad_s);
      break;
    case BodyAxis::kY:
      shape.pitch = drawn_sum(config, id, kPitch, config.rate_rms_rad_s);
      break;
    case BodyAxis::kZ:
      shape.yaw = drawn_sum(config, id, kYaw, config.rate_rms_rad_s);
      break;
  }
  return shape;
}

HarmonicTrajectory::Shape pure_translation_shape(const HandheldConfig& config, core::TrialId id) {
  const double speed = config.speed_rms_m_s * (1.0 / std::sqrt(3.0));
  HarmonicTrajectory::Shape shape;
  shape.position = {drawn_sum(config, id, kX, speed), drawn_sum(config, id, kY, speed),
                    drawn_sum(config, id, kZ, speed)};
  return shape;
}

HarmonicTrajectory::Shape pure_rotation_shape(const HandheldConfig& config, core::TrialId id) {
  const double rate = config.rate_rms_rad_s * (1.0 / std::sqrt(3.0));
  HarmonicTrajectory::Shape shape;
  shape.yaw = drawn_sum(config, id, kYaw, rate);
  shape.pitch = drawn_sum(config, id, kPitch, rate);
  shape.roll = drawn_sum(config, id, kRoll, rate);
  return shape;
}

}  // namespace plumbline::sim
