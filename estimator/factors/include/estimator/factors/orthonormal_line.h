// The orthonormal form of a line, four degrees of freedom (Bartoli, Sturm, CVIU 2005):
//   U in SO(3), columns u1 = n/|n|, u2 = d/|d|, u3 = u1 x u2        W = (w1, w2) = (|n|, |d|)/sqrt(|n|^2 + |d|^2)
//   L = (w1 u1, w2 u2), of unit norm
//   update   U <- U Exp(psi),   (w1, w2) <- (w1 cos phi - w2 sin phi, w1 sin phi + w2 cos phi)
//   dL/d(psi, phi) = [ 0, -w1 u3, w1 u2, -w2 u1 ;  w2 u3, 0, -w2 u1, w1 u2 ]
// A parameter block of 6 doubles [ U as quaternion x y z w | w1 w2 ]. W is kept as a point of the circle, not as an
// angle, so that nothing folds at 90 degrees.
//
// Where w1 = 0 (the line meets the origin) or w2 = 0 (the line at infinity) the update loses a dimension whatever is
// done. Hence a line has a constant origin o of its own, the first estimate of the centre of the camera that saw it
// first: L is about o, and positions enter as p - o.
#pragma once

#include <optional>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <ceres/manifold.h>

#include "estimator/factors/plucker.h"

namespace plumbline::estimator {

inline constexpr int kLineSize = 6;
inline constexpr int kLineDof = 4;
using LineBlock = Eigen::Matrix<double, kLineSize, 1>;

// Below this share of L, n or d has no direction to speak of.
inline constexpr double kDegenerateLine = 1e-9;

// Nothing where n or d is degenerate or not finite. n is made perpendicular to d where it is not.
std::optional<LineBlock> orthonormal_line(const PluckerLine& L);

// The columns of U and the weights.
struct OrthonormalLine {
  explicit OrthonormalLine(const double* block)
      : q(Eigen::Map<const Eigen::Quaterniond>(block)), U(q.toRotationMatrix()), w1(block[4]), w2(block[5]) {}

  PluckerLine plucker() const { return {w1 * U.col(0), w2 * U.col(1)}; }
  bool degenerate() const {
    const bool regular = std::abs(w1) > kDegenerateLine && std::abs(w2) > kDegenerateLine;  // NaN is not
    return !regular;
  }

  // A row of derivatives with respect to (n, d), on the tangent (psi, phi).
  Eigen::RowVector4d to_tangent(const Eigen::Vector3d& dr_dn, const Eigen::Vector3d& dr_dd) const {
    const Eigen::Vector3d n = U.transpose() * dr_dn;
    const Eigen::Vector3d d = U.transpose() * dr_dd;
    return {w2 * d.z(), -w1 * n.z(), w1 * n.y() - w2 * d.x(), w1 * d.y() - w2 * n.x()};
  }

  // A row of derivatives on the tangent, with respect to the block, as Ceres wants it.
  void write_row(const Eigen::RowVector4d& J, double* out) const;

  Eigen::Quaterniond q;
  Eigen::Matrix3d U;
  double w1;
  double w2;
};

class OrthonormalLineManifold final : public ceres::Manifold {
 public:
  int AmbientSize() const override { return kLineSize; }
  int TangentSize() const override { return kLineDof; }
  bool Plus(const double* x, const double* delta, double* x_plus_delta) const override;
  bool PlusJacobian(const double* x, double* jacobian) const override;
  bool Minus(const double* y, const double* x, double* y_minus_x) const override;
  bool MinusJacobian(const double* x, double* jacobian) const override;
};

}  // namespace plumbline::estimator
