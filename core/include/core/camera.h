// Pinhole camera. x right, y down, z forward; pixel (0, 0) is the centre of the upper left pixel.
//   u = fx x/z + cx,  v = fy y/z + cy          v is the row that a rolling shutter reads out (docs/conventions.md)
#pragma once

#include <optional>

#include <Eigen/Core>

namespace plumbline::core {

struct PinholeCamera {
  int width_px = 640;
  int height_px = 480;
  double fx_px = 460.0;
  double fy_px = 460.0;
  double cx_px = 319.5;
  double cy_px = 239.5;

  // Pixel of the point P_C in the camera frame (any positive scale of it will do, since only the direction counts);
  // nothing for a point that is not in front of the camera. J, if given, is d(u, v)/dP_C.
  std::optional<Eigen::Vector2d> project(const Eigen::Vector3d& P_C, Eigen::Matrix<double, 2, 3>* J = nullptr) const {
    // Nearer than a millionth of its lateral distance to the image plane is not in front of any real camera.
    if (!(P_C.z() > 1e-6 * P_C.head<2>().norm()) || !(P_C.z() > 0.0)) return std::nullopt;
    const double inv_z = 1.0 / P_C.z();
    const double x = P_C.x() * inv_z;
    const double y = P_C.y() * inv_z;
    if (J != nullptr) *J << fx_px * inv_z, 0.0, -fx_px * x * inv_z, 0.0, fy_px * inv_z, -fy_px * y * inv_z;
    return Eigen::Vector2d(fx_px * x + cx_px, fy_px * y + cy_px);
  }

  // The point (x, y, 1) of the normalised plane that the pixel sees.
  Eigen::Vector3d unproject(const Eigen::Vector2d& pixel) const {
    return {(pixel.x() - cx_px) / fx_px, (pixel.y() - cy_px) / fy_px, 1.0};
  }

  bool contains(const Eigen::Vector2d& pixel) const {
    return pixel.x() >= -0.5 && pixel.y() >= -0.5 && pixel.x() < width_px - 0.5 && pixel.y() < height_px - 0.5;
  }
};

}  // namespace plumbline::core
