#include "estimator/factors/bal_factors.h"

#include "core/lie.h"
#include "estimator/factors/skew_product.h"

namespace plumbline::estimator {
namespace {

using RowPair3 = Eigen::Matrix<double, 2, 3>;
template <int Columns>
using Rows2 = Eigen::Matrix<double, 2, Columns, Eigen::RowMajor>;

core::BalIntrinsics intrinsics_at(const double* x) { return {x[0], x[1], x[2]}; }

// d Exp(d) * q / d d at d = 0; rows x, y, z, w.
Eigen::Matrix<double, 4, 3> left_plus_jacobian(const Eigen::Quaterniond& q) {
  Eigen::Matrix<double, 4, 3> J;
  J << q.w(), q.z(), -q.y(),  //
      -q.z(), q.w(), q.x(),   //
      q.y(), -q.x(), q.w(),   //
      -q.x(), -q.y(), -q.z();
  return 0.5 * J;
}

}  // namespace

BalCameraBlock pack(const core::BalCamera& camera) {
  BalCameraBlock x;
  x << camera.w, camera.t, camera.intrinsics.f_px, camera.intrinsics.k1, camera.intrinsics.k2;
  return x;
}

BalLeftCameraBlock pack_left(const core::BalCamera& camera) {
  BalLeftCameraBlock x;
  x << core::exp_quaternion(camera.w).coeffs(), camera.t, camera.intrinsics.f_px, camera.intrinsics.k1,
      camera.intrinsics.k2;
  return x;
}

core::BalCamera unpack_bal_camera(const BalCameraBlock& block) {
  return {block.head<3>(), block.segment<3>(3), intrinsics_at(block.data() + 6)};
}

core::BalCamera unpack_bal_camera(const BalLeftCameraBlock& block) {
  const Eigen::Quaterniond q(Eigen::Map<const Eigen::Quaterniond>(block.data()));
  return {core::log_so3(q), block.segment<3>(4), intrinsics_at(block.data() + 7)};
}

bool LeftSo3Manifold::Plus(const double* x, const double* delta, double* x_plus_delta) const {
  const Eigen::Map<const Eigen::Quaterniond> q(x);
  Eigen::Map<Eigen::Quaterniond> result(x_plus_delta);
  result = (core::exp_quaternion(Eigen::Map<const Eigen::Vector3d>(delta)) * q).normalized();
  return true;
}

bool LeftSo3Manifold::PlusJacobian(const double* x, double* jacobian) const {
  Eigen::Map<Eigen::Matrix<double, 4, 3, Eigen::RowMajor>> J(jacobian);
  J = left_plus_jacobian(Eigen::Map<const Eigen::Quaterniond>(x));
  return true;
}

bool LeftSo3Manifold::Minus(const double* y, const double* x, double* y_minus_x) const {
  const Eigen::Map<const Eigen::Quaterniond> q_y(y);
  const Eigen::Map<const Eigen::Quaterniond> q_x(x);
  Eigen::Map<Eigen::Vector3d> delta(y_minus_x);
  delta = core::log_so3(Eigen::Quaterniond(q_y * q_x.conjugate()));
  return true;
}

bool LeftSo3Manifold::MinusJacobian(const double* x, double* jacobian) const {
  Eigen::Map<Eigen::Matrix<double, 3, 4, Eigen::RowMajor>> J(jacobian);
  J = 4.0 * left_plus_jacobian(Eigen::Map<const Eigen::Quaterniond>(x)).transpose();
  return true;
}

bool BalFactor::Evaluate(double const* const* parameters, double* residuals, double** jacobians) const {
  const Eigen::Map<const Eigen::Vector3d> w(parameters[0]);
  const Eigen::Map<const Eigen::Vector3d> t(parameters[0] + 3);
  const Eigen::Map<const Eigen::Vector3d> X(parameters[1]);
  double* J_camera_data = jacobians != nullptr ? jacobians[0] : nullptr;
  double* J_point_data = jacobians != nullptr ? jacobians[1] : nullptr;
  const bool wanted = J_camera_data != nullptr || J_point_data != nullptr;

  // R = cos I + a [w]x + b w w^T,   Jl = a I + b [w]x + c w w^T
  // with a = sin th/th, b = (1 - cos th)/th^2, c = (th - sin th)/th^3: one sine and one cosine for both.
  const double angle2 = w.squaredNorm();
  const auto [b, c] = core::rotation_coefficients(angle2);
  const double a = 1.0 - c * angle2;
  const double cos = 1.0 - b * angle2;
  const Eigen::Vector3d RX = cos * X + a * w.cross(X) + (b * w.dot(X)) * w;

  RowPair3 A;
  RowPair3 J_intrinsics;
  const auto pixel =
      core::project_bal(intrinsics_at(parameters[0] + 6), axis_, RX + t, wanted ? &A : nullptr, &J_intrinsics);
  if (!pixel) return false;
  Eigen::Map<Eigen::Vector2d> r(residuals);
  r = *pixel - observed_px_;

  if (J_camera_data != nullptr) {
    Eigen::Map<Rows2<kBalCameraSize>> J(J_camera_data);
    const RowPair3 G = -times_skew(A, RX);
    // G Jl(w): G [w]x = G x w by rows.
    J.leftCols<3>() = a * G + b * times_skew(G, w) + (c * (G * w)) * w.transpose();
    J.middleCols<3>(3) = A;
    J.rightCols<3>() = J_intrinsics;
  }
  if (J_point_data != nullptr) {
    Eigen::Map<Rows2<3>> J(J_point_data);
    J = cos * A + a * times_skew(A, w) + (b * (A * w)) * w.transpose();
  }
  return true;
}

bool BalLeftFactor::Evaluate(double const* const* parameters, double* residuals, double** jacobians) const {
  const Eigen::Quaterniond q(Eigen::Map<const Eigen::Quaterniond>{parameters[0]});
  const Eigen::Map<const Eigen::Vector3d> t(parameters[0] + 4);
  const Eigen::Map<const Eigen::Vector3d> X(parameters[1]);
  double* J_camera_data = jacobians != nullptr ? jacobians[0] : nullptr;
  double* J_point_data = jacobians != nullptr ? jacobians[1] : nullptr;
  const bool wanted = J_camera_data != nullptr || J_point_data != nullptr;

  const Eigen::Matrix3d R = q.toRotationMatrix();
  const Eigen::Vector3d RX = R * X;
  RowPair3 A;
  RowPair3 J_intrinsics;
  const auto pixel =
      core::project_bal(intrinsics_at(parameters[0] + 7), axis_, RX + t, wanted ? &A : nullptr, &J_intrinsics);
  if (!pixel) return false;
  Eigen::Map<Eigen::Vector2d> r(residuals);
  r = *pixel - observed_px_;

  if (J_camera_data != nullptr) {
    Eigen::Map<Rows2<kBalLeftCameraSize>> J(J_camera_data);
    // The tangent Jacobian times d Minus/d q, so that Ceres' product with PlusJacobian gives the tangent one again.
    J.leftCols<4>() = -times_skew(A, RX) * (4.0 * left_plus_jacobian(q).transpose());
    J.middleCols<3>(4) = A;
    J.rightCols<3>() = J_intrinsics;
  }
  if (J_point_data != nullptr) {
    Eigen::Map<Rows2<3>> J(J_point_data);
    J = A * R;
  }
  return true;
}

}  // namespace plumbline::estimator
