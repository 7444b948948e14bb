#include "estimator/factors/ray_chart.h"

#include <stdexcept>

#include <Eigen/Geometry>
#include <Eigen/LU>

namespace plumbline::estimator {
namespace {

// B N(p) for p = (x, y, 1), with respect to (x, y).
Eigen::Matrix2d to_tangent_plane(const Matrix23& B, const Eigen::Vector3d& p) {
  const double inv_norm = 1.0 / p.norm();
  const Matrix23 BN = inv_norm * B - (inv_norm * inv_norm * inv_norm) * (B * p) * p.transpose();
  return BN.leftCols<2>();
}

}  // namespace

Matrix23 tangent_basis(const Eigen::Vector3d& bearing) {
  const Eigen::Vector3d a = bearing.normalized();
  Eigen::Vector3d across = Eigen::Vector3d::UnitZ() - a.z() * a;
  if (across.norm() < 1e-6) across = Eigen::Vector3d::UnitX() - a.x() * a;
  Matrix23 B;
  B.row(0) = across.normalized();
  B.row(1) = a.cross(B.row(0).transpose());
  return B;
}

RayChart::RayChart(ResidualType type, const core::PinholeCamera& camera, double pixel_sigma_px,
                   const Eigen::Vector2d& observed_pixel)
    : type_(type), camera_(camera), inv_sigma_px_(1.0 / pixel_sigma_px), observed_(observed_pixel / pixel_sigma_px) {
  if (type_ == ResidualType::kPinhole) return;
  const Eigen::Vector3d p = camera.unproject(observed_pixel);
  Matrix23 J_pixel;
  if (!camera.project(p, &J_pixel)) throw std::invalid_argument("RayChart: no ray leads to the observed pixel");
  const Matrix23 B = tangent_basis(p);
  SB_ = inv_sigma_px_ * J_pixel.leftCols<2>() * to_tangent_plane(B, p).inverse() * B;
  observed_ = SB_ * p.normalized();
}

RayChart::RayChart(const core::PinholeCamera& camera, const Eigen::Vector3d& observed_bearing,
                   const Eigen::Matrix2d& sqrt_information)
    : type_(ResidualType::kUnitSphere),
      camera_(camera),
      SB_(sqrt_information * tangent_basis(observed_bearing)),
      observed_(SB_ * observed_bearing.normalized()) {}

bool RayChart::at(const Eigen::Vector3d& q, Eigen::Vector2d& h, Matrix23* J) const {
  if (type_ == ResidualType::kPinhole) {
    const auto pixel = camera_.project(q, J);
    if (!pixel) return false;
    h = inv_sigma_px_ * *pixel;
    if (J != nullptr) *J *= inv_sigma_px_;
    return true;
  }
  // The tangent plane alone could not tell a ray from its opposite.
  if (!(q.z() > 0.0)) return false;
  const double inv_norm = 1.0 / q.norm();
  const Eigen::Vector3d a = inv_norm * q;
  h = SB_ * a;
  if (J != nullptr) *J = inv_norm * (SB_ - h * a.transpose());
  return true;
}

}  // namespace plumbline::estimator
