#include "core/camera.h"

#include <stdexcept>

#include <fmt/format.h>

namespace plumbline::core {

PinholeCamera PinholeCamera::with(const Intrinsics& K) const {
  PinholeCamera camera = *this;
  camera.fx_px = K[0];
  camera.fy_px = K[1];
  camera.cx_px = K[2];
  camera.cy_px = K[3];
  return camera;
}

Eigen::Matrix<double, 2, 4> PinholeCamera::intrinsics_jacobian(const Eigen::Vector2d& pixel) const {
  Eigen::Matrix<double, 2, 4> J;
  J << (pixel.x() - cx_px) / fx_px, 0.0, 1.0, 0.0, 0.0, (pixel.y() - cy_px) / fy_px, 0.0, 1.0;
  return J;
}

std::optional<Eigen::Vector2d> PinholeCamera::project(const Eigen::Vector3d& P_C,
                                                      Eigen::Matrix<double, 2, 3>* J) const {
  // Nearer than a millionth of its lateral distance to the image plane is not in front of any real camera.
  if (!(P_C.z() > 1e-6 * P_C.head<2>().norm()) || !(P_C.z() > 0.0)) return std::nullopt;
  const double inv_z = 1.0 / P_C.z();
  const double x = P_C.x() * inv_z;
  const double y = P_C.y() * inv_z;
  if (distortion.model() == DistortionModel::kNone) {
    if (J != nullptr) *J << fx_px * inv_z, 0.0, -fx_px * x * inv_z, 0.0, fy_px * inv_z, -fy_px * y * inv_z;
    return Eigen::Vector2d(fx_px * x + cx_px, fy_px * y + cy_px);
  }
  Eigen::Matrix2d D;
  const auto xy_d = distortion.apply({x, y}, J != nullptr ? &D : nullptr);
  if (!xy_d) return std::nullopt;
  if (J != nullptr) {
    D.row(0) *= fx_px * inv_z;
    D.row(1) *= fy_px * inv_z;
    J->leftCols<2>() = D;
    J->col(2) = -D * Eigen::Vector2d(x, y);
  }
  return Eigen::Vector2d(fx_px * xy_d->x() + cx_px, fy_px * xy_d->y() + cy_px);
}

std::optional<Eigen::Vector3d> PinholeCamera::try_unproject(const Eigen::Vector2d& pixel) const {
  const auto xy = distortion.remove({(pixel.x() - cx_px) / fx_px, (pixel.y() - cy_px) / fy_px});
  if (!xy) return std::nullopt;
  return Eigen::Vector3d(xy->x(), xy->y(), 1.0);
}

Eigen::Vector3d PinholeCamera::unproject(const Eigen::Vector2d& pixel) const {
  const auto bearing = try_unproject(pixel);
  if (!bearing) {
    throw std::domain_error(
        fmt::format("no ray falls on pixel ({}, {}): it is beyond the fold of the lens", pixel.x(), pixel.y()));
  }
  return *bearing;
}

}  // namespace plumbline::core
