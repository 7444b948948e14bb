// Pinhole camera behind a lens. x right, y down, z forward; pixel (0, 0) is the centre of the upper left pixel.
//   (x, y) = (X/Z, Y/Z) -> (x_d, y_d) by the lens (core/distortion.h)
//   u = fx x_d + cx,  v = fy y_d + cy          v is the row that a rolling shutter reads out (docs/conventions.md)
#pragma once

#include <optional>

#include <Eigen/Core>

#include "core/distortion.h"

namespace plumbline::core {

using Intrinsics = Eigen::Vector4d;  // (fx, fy, cx, cy) [px]

struct PinholeCamera {
  int width_px = 640;
  int height_px = 480;
  double fx_px = 460.0;
  double fy_px = 460.0;
  double cx_px = 319.5;
  double cy_px = 239.5;
  Distortion distortion = {};

  Intrinsics intrinsics() const { return {fx_px, fy_px, cx_px, cy_px}; }
  PinholeCamera with(const Intrinsics& K) const;

  // d(u, v)/d(fx, fy, cx, cy) of the ray that the pixel sees.
  Eigen::Matrix<double, 2, 4> intrinsics_jacobian(const Eigen::Vector2d& pixel) const;

  // Pixel of the point P_C in the camera frame (any positive scale of it will do, since only the direction counts);
  // nothing for a point that is not in front of the camera or beyond the fold of its lens. J, if given, is
  // d(u, v)/dP_C.
  std::optional<Eigen::Vector2d> project(const Eigen::Vector3d& P_C, Eigen::Matrix<double, 2, 3>* J = nullptr) const;

  // The point (x, y, 1) of the normalised plane that the pixel sees; nothing where no ray falls on the pixel.
  std::optional<Eigen::Vector3d> try_unproject(const Eigen::Vector2d& pixel) const;

  // The same for a pixel that some ray falls on, as on all of them without a lens; throws std::domain_error for others.
  Eigen::Vector3d unproject(const Eigen::Vector2d& pixel) const;

  bool contains(const Eigen::Vector2d& pixel) const {
    return pixel.x() >= -0.5 && pixel.y() >= -0.5 && pixel.x() < width_px - 0.5 && pixel.y() < height_px - 0.5;
  }
};

}  // namespace plumbline::core
