#include "core/so3_manifold.h"

namespace plumbline::core {

Eigen::Matrix<double, 4, 3> plus_jacobian(const Eigen::Quaterniond& q) {
  Eigen::Matrix<double, 4, 3> J;
  J << q.w(), -q.z(), q.y(),  //
      q.z(), q.w(), -q.x(),   //
      -q.y(), q.x(), q.w(),   //
      -q.x(), -q.y(), -q.z();
  return 0.5 * J;
}

Eigen::Matrix<double, 3, 4> minus_jacobian(const Eigen::Quaterniond& q) { return 4.0 * plus_jacobian(q).transpose(); }

bool So3Manifold::Plus(const double* x, const double* delta, double* x_plus_delta) const {
  const Eigen::Map<const Eigen::Quaterniond> q(x);
  Eigen::Map<Eigen::Quaterniond> result(x_plus_delta);
  result = (q * exp_quaternion(Eigen::Map<const Eigen::Vector3d>(delta))).normalized();
  return true;
}

bool So3Manifold::PlusJacobian(const double* x, double* jacobian) const {
  Eigen::Map<Eigen::Matrix<double, 4, 3, Eigen::RowMajor>> J(jacobian);
  J = plus_jacobian(Eigen::Map<const Eigen::Quaterniond>(x));
  return true;
}

bool So3Manifold::Minus(const double* y, const double* x, double* y_minus_x) const {
  const Eigen::Map<const Eigen::Quaterniond> q_y(y);
  const Eigen::Map<const Eigen::Quaterniond> q_x(x);
  Eigen::Map<Eigen::Vector3d> delta(y_minus_x);
  delta = log_so3(Eigen::Quaterniond(q_x.conjugate() * q_y));
  return true;
}

bool So3Manifold::MinusJacobian(const double* x, double* jacobian) const {
  Eigen::Map<Eigen::Matrix<double, 3, 4, Eigen::RowMajor>> J(jacobian);
  J = minus_jacobian(Eigen::Map<const Eigen::Quaterniond>(x));
  return true;
}

}  // namespace plumbline::core
