#include "estimator/factors/point_factors.h"

#include <cmath>

#include "core/calibration.h"

namespace plumbline::estimator {
namespace {

using Matrix23 = Eigen::Matrix<double, 2, 3>;
using StateJacobian = Eigen::Matrix<double, 2, core::kStateDof>;

// Chain from the body at tau (position p additive in the world, theta on the right) to the state it is carried from.
StateJacobian chain_to_state(const Matrix23& J_p, const Matrix23& J_theta, const Eigen::Matrix3d& R_k,
                             const LocalPose& local, const LocalPoseJacobians& jacobians, double tau_s) {
  StateJacobian J;
  const Matrix23 J_p_body = J_p * R_k;
  J.middleCols<3>(core::kPosition) = J_p;
  J.middleCols<3>(core::kOrientation) = J_theta * local.R.transpose() - J_p_body * core::skew(local.p);
  J.middleCols<3>(core::kVelocity) = tau_s * J_p;
  J.middleCols<3>(core::kGyroBias) = J_p_body * jacobians.p_bg + J_theta * jacobians.R_bg;
  J.middleCols<3>(core::kAccelBias) = J_p_body * jacobians.p_ba;
  return J;
}

}  // namespace

bool body_at(const LocalMotion& motion, const core::State& state, double gravity_m_s2, double tau_s, TimedBody& body,
             LocalPoseJacobians* jacobians) {
  if (!motion.at(tau_s, state.bias, body.local, jacobians)) return false;
  const Eigen::Matrix3d R_k = state.T_W_B.q.toRotationMatrix();
  const Eigen::Vector3d gravity_W(0.0, 0.0, -gravity_m_s2);
  body.R = R_k * body.local.R;
  body.p = state.T_W_B.p + tau_s * state.v_W + 0.5 * tau_s * tau_s * gravity_W + R_k * body.local.p;
  body.velocity = state.v_W + tau_s * gravity_W + R_k * body.local.p_dot;
  return true;
}

bool PropagatedPointFactor::Evaluate(double const* const* parameters, double* residuals, double** jacobians) const {
  const core::State state_i = unpack_state(parameters[0]);
  const core::State state_j = unpack_state(parameters[1]);
  const core::Pose T_B_C = unpack_pose(parameters[2]);
  const double td = *parameters[3];
  const double readout = *parameters[4];
  const Eigen::Vector3d b(parameters[5][0], parameters[5][1], 1.0);
  const double lambda = parameters[5][2];
  const core::PinholeCamera& camera = model_.camera;
  const int rows = camera.height_px;
  const double s_per_row = readout / rows;

  // The anchor, at the time of the row of its bearing.
  Matrix23 J_anchor_pixel;
  const auto anchor_pixel = camera.project(b, &J_anchor_pixel);
  if (!anchor_pixel) return false;
  const double phase_a = core::row_phase(anchor_pixel->y(), rows);
  const double tau_a = anchor_.offset_s + td + phase_a * readout;
  TimedBody body_a;
  LocalPoseJacobians local_a;
  LocalPoseJacobians* wanted_a = jacobians != nullptr && jacobians[0] != nullptr ? &local_a : nullptr;
  if (!body_at(*anchor_.motion, state_i, model_.gravity_m_s2, tau_a, body_a, wanted_a)) return false;
  const Eigen::Matrix3d R_c = T_B_C.q.toRotationMatrix();
  const Eigen::Vector3d B = R_c * b + lambda * T_B_C.p;
  const Eigen::Vector3d W = body_a.R * B + lambda * body_a.p;

  // The observer, at the time of the row where the landmark is predicted: Newton's method from the measured row. The
  // last step is taken in the picture only; what it neglects is the square of (kTolerancePx readout/rows).
  constexpr int kMaxIterations = 10;
  constexpr double kTolerancePx = 1e-5;
  double row = observed_pixel_.y();
  double tau_b = 0.0;
  double slope = 1.0;  // 1 - k
  TimedBody body_b;
  LocalPoseJacobians local_b;
  LocalPoseJacobians* wanted_b = jacobians != nullptr && jacobians[1] != nullptr ? &local_b : nullptr;
  Eigen::Vector3d X;
  Eigen::Vector3d q;
  Eigen::Vector2d pixel;
  Eigen::Vector2d flow;  // h', px/s
  Matrix23 G;            // d pixel/d q
  for (int iteration = 0;; ++iteration) {
    tau_b = observer_.offset_s + td + core::row_phase(row, rows) * readout;
    if (!body_at(*observer_.motion, state_j, model_.gravity_m_s2, tau_b, body_b, wanted_b)) return false;
    X = body_b.R.transpose() * (W - lambda * body_b.p);
    q = R_c.transpose() * (X - lambda * T_B_C.p);
    const auto projected = camera.project(q, &G);
    if (!projected) return false;
    pixel = *projected;
    const Eigen::Vector3d X_dot = X.cross(body_b.local.omega) - lambda * (body_b.R.transpose() * body_b.velocity);
    flow = G * (R_c.transpose() * X_dot);
    slope = 1.0 - flow.y() * s_per_row;
    // Beyond a tenth the landmark races the shutter and the row is no longer unique.
    if (slope < 0.1) return false;
    const double defect = pixel.y() - row;
    row += defect / slope;
    if (std::abs(defect) < kTolerancePx || readout == 0.0) {
      pixel += flow * (s_per_row * defect / slope);
      break;
    }
    if (iteration == kMaxIterations) return false;
  }
  Eigen::Map<Eigen::Vector2d> r(residuals);
  r = (pixel - observed_pixel_) / model_.pixel_sigma_px;
  if (jacobians == nullptr) return true;

  Eigen::Matrix2d M = Eigen::Matrix2d::Identity();
  M.col(1) += flow * (s_per_row / slope);
  M /= model_.pixel_sigma_px;
  G = M * G;
  flow = M * flow;
  const Matrix23 J_X = G * R_c.transpose();
  const Matrix23 J_W = J_X * body_b.R.transpose();
  const Eigen::Vector3d W_dot = body_a.R * body_a.local.omega.cross(B) + lambda * body_a.velocity;
  const Eigen::Vector2d anchor_flow = J_W * W_dot;
  const Matrix23 J_B = J_W * body_a.R;

  if (jacobians[0] != nullptr) {
    const StateJacobian J = chain_to_state(lambda * J_W, -J_B * core::skew(B), state_i.T_W_B.q.toRotationMatrix(),
                                           body_a.local, local_a, tau_a);
    Eigen::Map<Eigen::Matrix<double, 2, kStateSize, Eigen::RowMajor>> ambient(jacobians[0]);
    lift_state_jacobian(J, state_i.T_W_B.q, ambient);
  }
  if (jacobians[1] != nullptr) {
    const StateJacobian J = chain_to_state(-lambda * J_W, J_X * core::skew(X), state_j.T_W_B.q.toRotationMatrix(),
                                           body_b.local, local_b, tau_b);
    Eigen::Map<Eigen::Matrix<double, 2, kStateSize, Eigen::RowMajor>> ambient(jacobians[1]);
    lift_state_jacobian(J, state_j.T_W_B.q, ambient);
  }
  if (jacobians[2] != nullptr) {
    Eigen::Matrix<double, 2, 6> J;
    J.leftCols<3>() = lambda * (J_B - J_X);
    J.rightCols<3>() = G * core::skew(q) - J_B * R_c * core::skew(b);
    Eigen::Map<Eigen::Matrix<double, 2, kPoseSize, Eigen::RowMajor>> ambient(jacobians[2]);
    lift_state_jacobian(J, T_B_C.q, ambient);
  }
  if (jacobians[3] != nullptr) {
    Eigen::Map<Eigen::Vector2d> J(jacobians[3]);
    J = anchor_flow + flow;
  }
  if (jacobians[4] != nullptr) {
    Eigen::Map<Eigen::Vector2d> J(jacobians[4]);
    J = phase_a * anchor_flow + core::row_phase(row, rows) * flow;
  }
  if (jacobians[5] != nullptr) {
    Eigen::Map<Eigen::Matrix<double, 2, kLandmarkSize, Eigen::RowMajor>> J(jacobians[5]);
    J.leftCols<2>() = (J_B * R_c).leftCols<2>() + anchor_flow * (s_per_row * J_anchor_pixel.row(1).head<2>());
    J.col(2) = J_B * T_B_C.p + J_W * (body_a.p - body_b.p) - J_X * T_B_C.p;
  }
  return true;
}

bool AnchorPointFactor::Evaluate(double const* const* parameters, double* residuals, double** jacobians) const {
  Matrix23 J_pixel;
  const auto pixel = model_.camera.project({parameters[0][0], parameters[0][1], 1.0}, &J_pixel);
  if (!pixel) return false;
  Eigen::Map<Eigen::Vector2d> r(residuals);
  r = (*pixel - observed_pixel_) / model_.pixel_sigma_px;
  if (jacobians != nullptr && jacobians[0] != nullptr) {
    Eigen::Map<Eigen::Matrix<double, 2, kLandmarkSize, Eigen::RowMajor>> J(jacobians[0]);
    J.leftCols<2>() = J_pixel.leftCols<2>() / model_.pixel_sigma_px;
    J.col(2).setZero();
  }
  return true;
}

}  // namespace plumbline::estimator
