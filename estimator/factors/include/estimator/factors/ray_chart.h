// The two numbers by which a ray q in the camera (any positive scale) is compared with an observed bearing p:
//   r = h(q) - h(p)
//   pinhole       h(q) = project(q) / sigma_px                       raw pixels
//   unit_sphere   h(q) = S B q/|q|,   h'(q) = S B N(q),   N(q) = I/|q| - q q^T/|q|^3
// B (2 x 3) spans the tangent plane of the unit sphere at the observed bearing; it is built once and held fixed, also
// where the bearing is shifted in time. S is the square-root information of B p/|p|: the pixel noise carried to the
// tangent plane. On the optical axis it is f/sigma_px times a rotation; elsewhere f/sigma_px would be too small, by
// |p| across the radius and |p|^2 along it.
// Source: Qin, Li, Shen, "VINS-Mono", TRO 2018, eq. 25 (S = f/sigma_px there).
#pragma once

#include <array>
#include <string_view>

#include <Eigen/Core>

#include "core/camera.h"

namespace plumbline::estimator {

using Matrix23 = Eigen::Matrix<double, 2, 3>;

enum class ResidualType { kPinhole, kUnitSphere };
inline constexpr std::array<std::string_view, 2> kResidualTypeNames = {"pinhole", "unit_sphere"};

// Rows b1 = normalised z - a (a.z), b2 = a x b1, with a = p/|p|; on the optical axis x stands for z.
Matrix23 tangent_basis(const Eigen::Vector3d& bearing);

class RayChart {
 public:
  // Whitens the noise of `observed_pixel`.
  RayChart(ResidualType type, const core::PinholeCamera& camera, double pixel_sigma_px,
           const Eigen::Vector2d& observed_pixel);

  // A unit sphere whose S is given.
  RayChart(const core::PinholeCamera& camera, const Eigen::Vector3d& observed_bearing,
           const Eigen::Matrix2d& sqrt_information);

  // False where the ray does not point to the front of the camera.
  bool at(const Eigen::Vector3d& q, Eigen::Vector2d& h, Matrix23* J = nullptr) const;

  // h of the observation itself.
  const Eigen::Vector2d& observed() const { return observed_; }

 private:
  ResidualType type_;
  core::PinholeCamera camera_;
  double inv_sigma_px_ = 1.0;
  Matrix23 SB_ = Matrix23::Zero();
  Eigen::Vector2d observed_;
};

}  // namespace plumbline::estimator
