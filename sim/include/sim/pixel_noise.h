// What is wrong with the pixel of an observation. h is the noise-free pixel, k counts the frames of a track:
//   z = h + e_k (+ gross outlier)     e_k = rho e_{k-1} + sqrt(1 - rho^2) sigma n_k,  e_0 = sigma n_0
// so that the variance of each coordinate is sigma^2 in every frame and the correlation of two is rho^|k - l|.
//   n_k ~ N(0, I), or a bivariate Student t of nu degrees of freedom scaled to unit variance:
//         n = sqrt((nu - 2)(u_0^(-2/nu) - 1)) (cos 2 pi u_1, sin 2 pi u_1)          (Bailey, Math. Comp. 62, 1994)
//         whose limit for nu -> infinity is the normal of core/random.h from the same u
//   gross outlier: N(0, sigma_gross^2 I) on top, by chance
//   uniform outlier: z anywhere in the picture, by chance
// Each has a stream of its own, indexed by frame and landmark, so that none changes the draws of another.
#pragma once

#include <cstdint>
#include <optional>

#include <Eigen/Core>

#include "core/random.h"
#include "sim/camera_config.h"

namespace plumbline::sim {

class PixelNoise {
 public:
  PixelNoise(const CameraConfig& config, core::TrialId id);

  // e_k, from that of the track's frame before.
  Eigen::Vector2d next_error(const std::optional<Eigen::Vector2d>& before, std::uint64_t frame,
                             std::uint64_t landmark) const;

  // z from h + e_k: as it is, or an outlier.
  Eigen::Vector2d spoil(const Eigen::Vector2d& pixel, std::uint64_t frame, std::uint64_t landmark) const;

 private:
  Eigen::Vector2d unit_noise(std::uint64_t frame, std::uint64_t landmark) const;

  const CameraConfig& config_;
  core::RandomStream noise_;
  core::RandomStream gross_;
  core::RandomStream gross_offset_;
  core::RandomStream uniform_;
  core::RandomStream uniform_pixel_;
};

}  // namespace plumbline::sim
