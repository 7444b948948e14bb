// SO(3) and rigid transforms with perturbations on the right: R <- R Exp(dtheta), positions additive in the outer
// frame. Sola, Deray, Atchuthan, "A micro Lie theory for state estimation in robotics", 2018 (equations named below).
//
// The functions are templates so that the same lines serve double and automatic differentiation.
#pragma once

#include <cmath>
#include <numbers>

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace plumbline::core {

template <class T>
using Vector3 = Eigen::Matrix<T, 3, 1>;
template <class T>
using Matrix3 = Eigen::Matrix<T, 3, 3>;

// [a]x with [a]x b = a x b.
template <class Derived>
Matrix3<typename Derived::Scalar> skew(const Eigen::MatrixBase<Derived>& a) {
  using T = typename Derived::Scalar;
  Matrix3<T> m;
  m << T(0), -a.z(), a.y(), a.z(), T(0), -a.x(), -a.y(), a.x(), T(0);
  return m;
}

namespace detail {
// Below this angle^2 the series are used: their first neglected term is under 1e-16 relative. The rotation between two
// IMU samples stays below it, so that integration needs no trigonometry.
inline constexpr double kSmallAngleSquared = 1e-3;
}  // namespace detail

// Unit quaternion of the rotation vector theta [rad]; exact to rounding at any angle.
template <class Derived>
Eigen::Quaternion<typename Derived::Scalar> exp_quaternion(const Eigen::MatrixBase<Derived>& theta) {
  using std::cos;
  using std::sin;
  using std::sqrt;
  using T = typename Derived::Scalar;
  const T angle2 = theta.squaredNorm();
  T real;
  T scale;  // sin(angle/2) / angle
  if (angle2 < T(detail::kSmallAngleSquared)) {
    real = T(1) - angle2 / T(8) * (T(1) - angle2 / T(48) * (T(1) - angle2 / T(120)));
    scale = T(0.5) - angle2 / T(48) * (T(1) - angle2 / T(80) * (T(1) - angle2 / T(168)));
  } else {
    const T angle = sqrt(angle2);
    real = cos(T(0.5) * angle);
    scale = sin(T(0.5) * angle) / angle;
  }
  return Eigen::Quaternion<T>(real, scale * theta.x(), scale * theta.y(), scale * theta.z());
}

// Rotation matrix of the rotation vector theta: Rodrigues' formula (Sola eq. 70).
template <class Derived>
Matrix3<typename Derived::Scalar> exp_so3(const Eigen::MatrixBase<Derived>& theta) {
  return exp_quaternion(theta).toRotationMatrix();
}

// Rotation vector of a unit quaternion, |Log| <= pi; q and -q give the same.
template <class T>
Vector3<T> log_so3(const Eigen::Quaternion<T>& q) {
  using std::atan2;
  using std::sqrt;
  const T sign = q.w() < T(0) ? T(-1) : T(1);
  const T w = sign * q.w();
  const Vector3<T> v = sign * q.vec();
  const T n2 = v.squaredNorm();
  if (n2 < T(detail::kSmallAngleSquared)) {
    const T r2 = n2 / (w * w);  // tan^2(angle/2)
    return v * (T(2) / w * (T(1) - r2 * (T(1) / T(3) - r2 * (T(1) / T(5) - r2 * (T(1) / T(7) - r2 / T(9))))));
  }
  const T n = sqrt(n2);
  return v * (T(2) * atan2(n, w) / n);
}

// b = (1 - cos angle) / angle^2 and c = (angle - sin angle) / angle^3, which make up Exp and its Jacobians:
//   cos angle = 1 - b angle^2        sin angle / angle = 1 - c angle^2
struct RotationCoefficients {
  double b;
  double c;
};
inline RotationCoefficients rotation_coefficients(double angle2) {
  if (angle2 < detail::kSmallAngleSquared) {
    return {0.5 - angle2 / 24.0 * (1.0 - angle2 / 30.0 * (1.0 - angle2 / 56.0)),
            1.0 / 6.0 - angle2 / 120.0 * (1.0 - angle2 / 42.0 * (1.0 - angle2 / 72.0))};
  }
  const double angle = std::sqrt(angle2);
  return {(1.0 - std::cos(angle)) / angle2, (angle - std::sin(angle)) / (angle2 * angle)};
}

// Right Jacobian: Exp(theta + d) = Exp(theta) Exp(Jr(theta) d) to first order (Sola eq. 143).
inline Eigen::Matrix3d right_jacobian(const Eigen::Vector3d& theta) {
  const double angle2 = theta.squaredNorm();
  const auto [a, b] = rotation_coefficients(angle2);
  Eigen::Matrix3d J = b * theta * theta.transpose() - a * skew(theta);
  J.diagonal().array() += 1.0 - b * angle2;
  return J;
}

// Jr(theta) x
inline Eigen::Vector3d right_jacobian_times(const Eigen::Vector3d& theta, const Eigen::Vector3d& x) {
  const auto [a, b] = rotation_coefficients(theta.squaredNorm());
  const Eigen::Vector3d c = theta.cross(x);
  return x - a * c + b * theta.cross(c);
}

// Inverse of the right Jacobian (Sola eq. 144); |theta| < 2 pi. Its coefficient 1/angle^2 - (1 + cos)/(2 angle sin) is
// written with the half angle, since 1 + cos and sin both vanish at pi.
inline Eigen::Matrix3d right_jacobian_inverse(const Eigen::Vector3d& theta) {
  const double angle2 = theta.squaredNorm();
  double b;
  if (angle2 < detail::kSmallAngleSquared) {
    b = 1.0 / 12.0 + angle2 / 720.0 * (1.0 + angle2 / 42.0 * (1.0 + angle2 / 40.0));
  } else {
    const double half = 0.5 * std::sqrt(angle2);
    b = (1.0 - half / std::tan(half)) / angle2;
  }
  const Eigen::Matrix3d S = skew(theta);
  return Eigen::Matrix3d::Identity() + 0.5 * S + b * S * S;
}

// Left Jacobian: Exp(theta + d) = Exp(Jl(theta) d) Exp(theta) to first order; Jl(theta) = Jr(-theta).
inline Eigen::Matrix3d left_jacobian(const Eigen::Vector3d& theta) { return right_jacobian(-theta); }

// T_A_B: a point's coordinates in B to those in A, x_A = R_A_B x_B + p_A_B.
struct Pose {
  Eigen::Quaterniond q = Eigen::Quaterniond::Identity();  // R_A_B
  Eigen::Vector3d p = Eigen::Vector3d::Zero();            // p_A_B [m], the origin of B in A

  Eigen::Vector3d operator*(const Eigen::Vector3d& x) const { return q * x + p; }
  Pose operator*(const Pose& T_B_C) const { return {(q * T_B_C.q).normalized(), q * T_B_C.p + p}; }
  Pose inverse() const { return {q.conjugate(), -(q.conjugate() * p)}; }
};

// The angle of a rotation, in [0, pi] rad.
inline double rotation_angle(const Eigen::Quaterniond& q) { return log_so3(q).norm(); }

inline constexpr double kDegreesPerRadian = 180.0 / std::numbers::pi;

}  // namespace plumbline::core
