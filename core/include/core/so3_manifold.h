// SO(3) for Ceres, unit quaternions stored x, y, z, w, perturbed on the right by the whole angle:
//   Plus(q, d) = q * Exp(d),   Minus(y, x) = Log(x^-1 * y)
// Ceres' own EigenQuaternionManifold perturbs on the left by half the angle.
#pragma once

#include <ceres/manifold.h>

#include "core/lie.h"

namespace plumbline::core {

// d Plus(q, d)/d d at d = 0, and the inverse of it on the tangent space: d Minus(y, q)/d y at y = q.
Eigen::Matrix<double, 4, 3> plus_jacobian(const Eigen::Quaterniond& q);
Eigen::Matrix<double, 3, 4> minus_jacobian(const Eigen::Quaterniond& q);

class So3Manifold final : public ceres::Manifold {
 public:
  int AmbientSize() const override { return 4; }
  int TangentSize() const override { return 3; }
  bool Plus(const double* x, const double* delta, double* x_plus_delta) const override;
  bool PlusJacobian(const double* x, double* jacobian) const override;
  bool Minus(const double* y, const double* x, double* y_minus_x) const override;
  bool MinusJacobian(const double* x, double* jacobian) const override;
};

}  // namespace plumbline::core
