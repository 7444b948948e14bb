// Differences between states in which a change of the world's frame is the same for all of them:
//   xi = [ rho | phi | nu | d_bg | d_ba ],   R = Exp(phi) R0,   p = Exp(phi) p0 + rho,   v = Exp(phi) v0 + nu
// A rotation by alpha about the vertical and a move by t change every state by rho = t, phi = alpha e_z to first order,
// wherever the states are: the four directions that a camera and an IMU cannot observe do not depend on the
// linearisation point, the velocity's part included, and no later estimate can make old information speak of them.
// (The group of Barrau and Bonnabel, "The invariant extended Kalman filter as a stable observer", TAC 2017; the
// argument is that of Huang, Mourikis, Roumeliotis, "Observability-based rules", IJRR 2010.)
#pragma once

#include "core/state.h"
#include "estimator/factors/preintegration.h"

namespace plumbline::estimator {

// xi of x about x0.
inline core::StateTangent invariant_difference(const core::State& x, const core::State& x0) {
  const Eigen::Quaterniond D = x.T_W_B.q * x0.T_W_B.q.conjugate();
  core::StateTangent xi;
  xi.segment<3>(core::kPosition) = x.T_W_B.p - D * x0.T_W_B.p;
  xi.segment<3>(core::kOrientation) = core::log_so3(D);
  xi.segment<3>(core::kVelocity) = x.v_W - D * x0.v_W;
  xi.segment<3>(core::kGyroBias) = x.bias.gyro_rad_s - x0.bias.gyro_rad_s;
  xi.segment<3>(core::kAccelBias) = x.bias.accel_m_s2 - x0.bias.accel_m_s2;
  return xi;
}

// d xi/d delta at x, delta the tangent of core/state.h.
inline StateMatrix invariant_difference_jacobian(const core::State& x, const core::StateTangent& xi) {
  const Eigen::Matrix3d R = x.T_W_B.q.toRotationMatrix();
  StateMatrix J = StateMatrix::Identity();
  J.block<3, 3>(core::kPosition, core::kOrientation) = core::skew(x.T_W_B.p - xi.segment<3>(core::kPosition)) * R;
  J.block<3, 3>(core::kOrientation, core::kOrientation) =
      core::right_jacobian_inverse(-xi.segment<3>(core::kOrientation)) * R;
  J.block<3, 3>(core::kVelocity, core::kOrientation) = core::skew(x.v_W - xi.segment<3>(core::kVelocity)) * R;
  return J;
}

// d delta/d xi at x, about x itself.
inline StateMatrix from_invariant(const core::State& x) {
  StateMatrix M = StateMatrix::Identity();
  M.block<3, 3>(core::kPosition, core::kOrientation) = -core::skew(x.T_W_B.p);
  M.block<3, 3>(core::kOrientation, core::kOrientation) = x.T_W_B.q.toRotationMatrix().transpose();
  M.block<3, 3>(core::kVelocity, core::kOrientation) = -core::skew(x.v_W);
  return M;
}

// H <- J^T H J and g <- J^T g in the columns of one state, J one of the two above: only its columns of orientation are
// not those of the identity.
inline void change_chart(int column, const StateMatrix& J, Eigen::MatrixXd& H, Eigen::VectorXd& g) {
  static_assert(core::kOrientation == 3 && core::kGyroBias == 9);
  const Eigen::Matrix<double, 9, 3> K = J.block<9, 3>(0, core::kOrientation);
  const int orientation = column + core::kOrientation;
  H.middleCols<3>(orientation) = (H.middleCols<9>(column) * K).eval();
  H.middleRows<3>(orientation) = (K.transpose() * H.middleRows<9>(column)).eval();
  g.segment<3>(orientation) = (K.transpose() * g.segment<9>(column)).eval();
}

}  // namespace plumbline::estimator
