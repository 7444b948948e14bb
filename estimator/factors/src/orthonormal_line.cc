#include "estimator/factors/orthonormal_line.h"

#include <cmath>

#include "core/lie.h"
#include "core/so3_manifold.h"

namespace plumbline::estimator {

std::optional<LineBlock> orthonormal_line(const PluckerLine& L) {
  const double d = L.d.norm();
  const Eigen::Vector3d u2 = L.d / d;
  const Eigen::Vector3d n = L.n - L.n.dot(u2) * u2;
  const double norm = std::hypot(n.norm(), d);
  if (!std::isfinite(norm)) return std::nullopt;
  if (!(n.norm() > kDegenerateLine * norm && d > kDegenerateLine * norm)) return std::nullopt;
  Eigen::Matrix3d U;
  U.col(0) = n.normalized();
  U.col(1) = u2;
  U.col(2) = U.col(0).cross(u2);
  LineBlock block;
  block << Eigen::Quaterniond(U).coeffs(), n.norm() / norm, d / norm;
  return block;
}

void OrthonormalLine::write_row(const Eigen::RowVector4d& J, double* out) const {
  Eigen::Map<Eigen::Matrix<double, 1, kLineSize>> row(out);
  row.head<4>() = J.head<3>() * core::minus_jacobian(q);
  row.tail<2>() << -w2 * J[3], w1 * J[3];
}

bool OrthonormalLineManifold::Plus(const double* x, const double* delta, double* x_plus_delta) const {
  const Eigen::Map<const Eigen::Quaterniond> q(x);
  Eigen::Map<Eigen::Quaterniond> result(x_plus_delta);
  result = (q * core::exp_quaternion(Eigen::Map<const Eigen::Vector3d>(delta))).normalized();
  const double c = std::cos(delta[3]);
  const double s = std::sin(delta[3]);
  const Eigen::Vector2d W(c * x[4] - s * x[5], s * x[4] + c * x[5]);
  Eigen::Map<Eigen::Vector2d>{x_plus_delta + 4} = W.normalized();
  return true;
}

bool OrthonormalLineManifold::PlusJacobian(const double* x, double* jacobian) const {
  Eigen::Map<Eigen::Matrix<double, kLineSize, kLineDof, Eigen::RowMajor>> J(jacobian);
  J.setZero();
  J.topLeftCorner<4, 3>() = core::plus_jacobian(Eigen::Map<const Eigen::Quaterniond>(x));
  J(4, 3) = -x[5];
  J(5, 3) = x[4];
  return true;
}

bool OrthonormalLineManifold::Minus(const double* y, const double* x, double* y_minus_x) const {
  const Eigen::Map<const Eigen::Quaterniond> q_y(y);
  const Eigen::Map<const Eigen::Quaterniond> q_x(x);
  Eigen::Map<Eigen::Vector3d>{y_minus_x} = core::log_so3(Eigen::Quaterniond(q_x.conjugate() * q_y));
  y_minus_x[3] = std::atan2(x[4] * y[5] - x[5] * y[4], x[4] * y[4] + x[5] * y[5]);
  return true;
}

bool OrthonormalLineManifold::MinusJacobian(const double* x, double* jacobian) const {
  Eigen::Map<Eigen::Matrix<double, kLineDof, kLineSize, Eigen::RowMajor>> J(jacobian);
  J.setZero();
  J.topLeftCorner<3, 4>() = core::minus_jacobian(Eigen::Map<const Eigen::Quaterniond>(x));
  J(3, 4) = -x[5];
  J(3, 5) = x[4];
  return true;
}

}  // namespace plumbline::estimator
