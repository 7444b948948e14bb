#include "sim/imu_config.h"

#include "core/physical_ranges.h"

namespace plumbline::sim {

using core::at_least;
using core::between;
using core::up_to;
using core::within;

void visit(core::ConfigVisitor& v, ImuConfig& c) {
  v.value("rate_hz", c.rate_hz, between(10.0, 10000.0), "samples a second");
  const core::Range density = up_to(core::kMostNoiseDensity);
  v.value("gyro_noise_density_rad_s_sqrt_hz", c.noise.gyro_noise_density, density, "white noise, continuous time");
  v.value("gyro_bias_walk_rad_s2_sqrt_hz", c.noise.gyro_bias_walk, density, "random walk of the bias");
  v.value("accel_noise_density_m_s2_sqrt_hz", c.noise.accel_noise_density, density, "white noise, continuous time");
  v.value("accel_bias_walk_m_s3_sqrt_hz", c.noise.accel_bias_walk, density, "random walk of the bias");
  v.value("gyro_bias_rad_s", c.gyro_bias_rad_s, within(core::kMostRateRadS), "true bias at the start, body axes");
  v.value("accel_bias_m_s2", c.accel_bias_m_s2, within(core::kMostAccelerationMS2),
          "true bias at the start, body axes");

  const core::Range share = between(-0.5, 0.5);
  v.value("gyro_scale_error", c.gyro.scale_error, share, "of each axis; 0.01 reads 1 % too much");
  v.value("accel_scale_error", c.accel.scale_error, share, "likewise");
  v.value("gyro_misalignment_rad", c.gyro.misalignment_rad, share,
          "xy, xz, yx, yz, zx, zy; ij: how much of the input on j the axis i feels");
  v.value("accel_misalignment_rad", c.accel.misalignment_rad, share, "likewise");
  v.value("gyro_g_sensitivity_rad_s_per_m_s2", c.g_sensitivity, between(-0.1, 0.1),
          "rate felt by a specific force, 3x3 row by row");
  v.value("gyro_noise_factor", c.gyro.noise_factor, up_to(1e3),
          "true white noise of each axis over what the data sheet states");
  v.value("accel_noise_factor", c.accel.noise_factor, up_to(1e3), "likewise");
  v.value("gyro_quantisation_rad_s", c.gyro.quantisation, up_to(core::kMostGyroReadingRadS),
          "step of the reading; 0: none");
  v.value("accel_quantisation_m_s2", c.accel.quantisation, up_to(core::kMostAccelReadingMS2),
          "step of the reading; 0: none");
  v.value("gyro_saturation_rad_s", c.gyro.saturation, up_to(core::kMostGyroReadingRadS),
          "largest reading of an axis; 0: no limit");
  v.value("accel_saturation_m_s2", c.accel.saturation, up_to(core::kMostAccelReadingMS2),
          "largest reading of an axis; 0: no limit");
  v.value("stamp_jitter_s", c.stamp_jitter_s, core::non_negative(),
          "sigma of the stamps about the true times, cut at 4 sigma; not of the first and last");
  v.value("dropout_probability", c.dropout_probability, core::probability(),
          "that samples are missing from here on; never the first and last");
  v.value("dropout_samples", c.dropout_samples, at_least(1), "how many are missing in a row");
}

std::optional<core::RuleViolation> validate(const ImuConfig& c) {
  // Four sigma either way must leave the stamps in order.
  if (c.stamp_jitter_s * c.rate_hz > 0.1) {
    return core::RuleViolation{"stamp_jitter_s", "must be <= a tenth of the interval, 0.1 / rate_hz"};
  }
  return std::nullopt;
}

}  // namespace plumbline::sim
