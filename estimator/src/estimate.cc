#include "estimator/estimate.h"

#include <fmt/format.h>

#include "core/error.h"
#include "estimator/batch.h"

namespace plumbline::estimator {
namespace {

void require_positive(double value, std::string_view key, std::string_view meaning) {
  if (!(value > 0.0)) {
    throw core::ConfigError(fmt::format("{}: must be > 0 for the estimator ({} is {})", key, meaning, value));
  }
}

}  // namespace

void require_usable(const BelievedNoise& noise, const core::CalibrationSigmas& sigma, const EstimateWhat& free) {
  const std::string_view fallback = "it defaults to the scenario's, which";
  require_positive(noise.pixel_sigma_px, "estimator.pixel_sigma_px", fallback);
  require_positive(noise.imu.gyro_noise_density, "estimator.imu.gyro_noise_density_rad_s_sqrt_hz", fallback);
  require_positive(noise.imu.gyro_bias_walk, "estimator.imu.gyro_bias_walk_rad_s2_sqrt_hz", fallback);
  require_positive(noise.imu.accel_noise_density, "estimator.imu.accel_noise_density_m_s2_sqrt_hz", fallback);
  require_positive(noise.imu.accel_bias_walk, "estimator.imu.accel_bias_walk_m_s3_sqrt_hz", fallback);
  const std::string_view width = "a free parameter needs a prior with a width, which";
  if (free.td) require_positive(sigma.td_s, "scenario.prior.td_sigma_s", width);
  if (free.readout) require_positive(sigma.readout_s, "scenario.prior.readout_sigma_s", width);
  if (free.extrinsics) {
    require_positive(sigma.extrinsic_position_m, "scenario.prior.extrinsic_position_sigma_m", width);
    require_positive(sigma.extrinsic_rotation_rad, "scenario.prior.extrinsic_rotation_sigma_rad", width);
  }
}

core::EstimateLog estimate(const core::MeasurementLog& log, const EstimatorConfig& config) {
  require_usable(believed_noise(config, log.imu_noise, log.pixel_sigma_px), log.prior.calibration_sigma,
                 config.estimate);
  switch (config.type) {
    case EstimatorType::kBatch:
      return estimate_batch(log, config);
  }
  throw std::logic_error("estimate: unknown type");
}

}  // namespace plumbline::estimator
