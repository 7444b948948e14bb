// The camera of "Bundle adjustment in the large" (Agarwal, Snavely, Seitz, Szeliski, ECCV 2010; BAL files):
//   P_C = R X + t        (x, y) = s (P_C,x, P_C,y) / P_C,z        r2 = x^2 + y^2        d = 1 + k1 r2 + k2 r2^2
//   (u, v) = f d (x, y)   [px from the centre of the picture]      R = Exp(w), world to camera
// s = -1 where the camera looks down its -z axis (Bundler, BAL files), s = +1 for our own camera frames. (u, v) is odd
// in (x, y), so s changes the sign of the pixel and of all its derivatives, and nothing else.
#pragma once

#include <cmath>
#include <optional>

#include <Eigen/Core>

#include "core/lie.h"

namespace plumbline::core {

enum class ViewAxis { kPlusZ, kMinusZ };

struct BalIntrinsics {
  double f_px = 1.0;
  double k1 = 0.0;
  double k2 = 0.0;
};

// In the order of BAL files.
struct BalCamera {
  Eigen::Vector3d w = Eigen::Vector3d::Zero();  // rotation vector of R_C_W [rad]
  Eigen::Vector3d t = Eigen::Vector3d::Zero();  // p_C_W, the world's origin in the camera
  BalIntrinsics intrinsics{};

  Eigen::Vector3d centre() const { return -(exp_so3(w).transpose() * t); }  // in the world
};

// Nothing where the point lies in the plane of the camera's centre. A point *behind* the camera is projected as well,
// as the reference cost of BAL does: the problems start with such points, and rejecting them would reject the start.
// Derivatives of (u, v) on demand: J_P by P_C, J_intrinsics by (f, k1, k2).
inline std::optional<Eigen::Vector2d> project_bal(const BalIntrinsics& camera, ViewAxis axis,
                                                  const Eigen::Vector3d& P_C,
                                                  Eigen::Matrix<double, 2, 3>* J_P = nullptr,
                                                  Eigen::Matrix<double, 2, 3>* J_intrinsics = nullptr) {
  const double inv_z = (axis == ViewAxis::kPlusZ ? 1.0 : -1.0) / P_C.z();
  const double x = P_C.x() * inv_z;
  const double y = P_C.y() * inv_z;
  const double r2 = x * x + y * y;
  const double d = 1.0 + r2 * (camera.k1 + camera.k2 * r2);
  const double f = camera.f_px;
  Eigen::Vector2d pixel(f * d * x, f * d * y);
  if (!std::isfinite(pixel.x()) || !std::isfinite(pixel.y())) return std::nullopt;
  if (J_P != nullptr) {
    const double g2 = 2.0 * (camera.k1 + 2.0 * camera.k2 * r2);  // 2 g, g = dd/dr2
    const double fxy = f * g2 * x * y;
    const double radial = f * (d + g2 * r2);
    // d(x, y)/dP_C,z = -(x, y)/P_C,z for either axis.
    *J_P << inv_z * f * (d + g2 * x * x), inv_z * fxy, -radial * x / P_C.z(),  //
        inv_z * fxy, inv_z * f * (d + g2 * y * y), -radial * y / P_C.z();
  }
  if (J_intrinsics != nullptr) {
    *J_intrinsics << d * x, f * r2 * x, f * r2 * r2 * x,  //
        d * y, f * r2 * y, f * r2 * r2 * y;
  }
  return pixel;
}

// In front of the camera, on the side it looks to.
inline bool in_front(const BalCamera& camera, ViewAxis axis, const Eigen::Vector3d& X) {
  const double z = (exp_so3(camera.w) * X + camera.t).z();
  return axis == ViewAxis::kPlusZ ? z > 0.0 : z < 0.0;
}

}  // namespace plumbline::core
