#include "sim/pixel_noise.h"

#include <cmath>
#include <numbers>

namespace plumbline::sim {

PixelNoise::PixelNoise(const CameraConfig& config, core::TrialId id)
    : config_(config),
      noise_(id, "cam0/pixel_noise"),
      gross_(id, "cam0/gross_outlier"),
      gross_offset_(id, "cam0/gross_outlier_offset"),
      uniform_(id, "cam0/uniform_outlier"),
      uniform_pixel_(id, "cam0/uniform_outlier_pixel") {}

Eigen::Vector2d PixelNoise::unit_noise(std::uint64_t frame, std::uint64_t landmark) const {
  if (!config_.pixel_noise_dof) return noise_.normal2(frame, landmark);
  const double nu = *config_.pixel_noise_dof;
  const auto u = noise_.uniforms(frame, landmark);
  const double radius = std::sqrt((nu - 2.0) * std::expm1(-2.0 / nu * std::log(u[0])));
  const double angle = 2.0 * std::numbers::pi * u[1];
  return {radius * std::cos(angle), radius * std::sin(angle)};
}

Eigen::Vector2d PixelNoise::next_error(const std::optional<Eigen::Vector2d>& before, std::uint64_t frame,
                                       std::uint64_t landmark) const {
  const double rho = config_.pixel_noise_correlation;
  Eigen::Vector2d fresh = config_.pixel_sigma_px * unit_noise(frame, landmark);
  if (!before || rho == 0.0) return fresh;
  return rho * *before + std::sqrt(1.0 - rho * rho) * fresh;
}

Eigen::Vector2d PixelNoise::spoil(const Eigen::Vector2d& pixel, std::uint64_t frame, std::uint64_t landmark) const {
  if (uniform_.uniform(frame, landmark) < config_.uniform_outlier_probability) {
    const auto u = uniform_pixel_.uniforms(frame, landmark);
    return {u[0] * config_.model.width_px - 0.5, u[1] * config_.model.height_px - 0.5};
  }
  if (gross_.uniform(frame, landmark) < config_.gross_outlier_probability) {
    return pixel + config_.gross_outlier_sigma_px * gross_offset_.normal2(frame, landmark);
  }
  return pixel;
}

}  // namespace plumbline::sim
