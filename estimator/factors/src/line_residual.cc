#include "estimator/factors/line_residual.h"

#include <cmath>

#include <Eigen/LU>

namespace plumbline::estimator {

LineEndPoint::LineEndPoint(const core::PinholeCamera& camera, const Eigen::Vector2d& observed_px)
    : pixel(observed_px), b(camera.unproject(observed_px)) {
  Eigen::Matrix<double, 2, 3> J;
  D = camera.project(b, &J) ? Eigen::Matrix2d(J.leftCols<2>().inverse()) : Eigen::Matrix2d::Zero();
}

std::array<LineEndPoint, 2> line_end_points(const core::PinholeCamera& camera, const SegmentPixels& observed) {
  return {LineEndPoint(camera, observed[0]), LineEndPoint(camera, observed[1])};
}

bool line_distance(const Eigen::Vector3d& n_c, const Eigen::Vector3d& b, const Eigen::Matrix2d& D, LineDistance& out) {
  const Eigen::Vector2d gradient = D.transpose() * n_c.head<2>();
  const double m2 = gradient.squaredNorm();
  const double m = std::sqrt(m2);
  if (!(m > kSmallestLineGradient * n_c.norm() * D.norm())) return false;
  const double F = n_c.dot(b);
  out.r_px = F / m;
  out.dr_dn = b / m;
  out.dr_dn.head<2>() -= D * gradient * (F / (m2 * m));
  return std::isfinite(out.r_px);
}

}  // namespace plumbline::estimator
