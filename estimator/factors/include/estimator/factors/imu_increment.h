// Relative motion from inertial samples, by the midpoint rule:
//   phi = ((w0 + w1)/2 - b_g) dt          R1 = R0 Exp(phi)
//   a   = (R0 (a0 - b_a) + R1 (a1 - b_a)) / 2
//   v1  = v0 + a dt                       p1 = p0 + v0 dt + a dt^2 / 2
// A step with negative dt is the exact inverse of the step forward. Second order in dt.
#pragma once

#include <span>

#include <Eigen/Core>

#include "core/lie.h"
#include "core/measurements.h"
#include "core/state.h"
#include "core/time.h"
#include "estimator/factors/skew_product.h"

namespace plumbline::estimator {

// Motion since the start in the body frame of the start, without gravity and initial velocity, and its derivatives with
// respect to the biases (R on the right).
struct ImuIncrement {
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
  Eigen::Vector3d v = Eigen::Vector3d::Zero();
  Eigen::Vector3d p = Eigen::Vector3d::Zero();
  Eigen::Matrix3d R_bg = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d v_bg = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d v_ba = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d p_bg = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d p_ba = Eigen::Matrix3d::Zero();
};

// One step as a linear map of small changes at its start, of orientation (theta, on the right) and biases:
//   theta' = dR^T theta - Jr_dt b_g            a = -H theta + G b_g - M b_a
//   H = R0 [f0]x/2 + R1 [f1]x/2 dR^T,   G = R1 [f1]x/2 Jr_dt,   M = (R0 + R1)/2
// White noise of the samples acts as one more bias.
struct ImuStep {
  double dt = 0.0;
  Eigen::Matrix3d dR_T;   // Exp(phi)^T
  Eigen::Matrix3d Jr_dt;  // Jr(phi) dt
  Eigen::Matrix3d H;
  Eigen::Matrix3d G;
  Eigen::Matrix3d M;
};

inline ImuStep advance(const core::ImuSample& s0, const core::ImuSample& s1, const core::ImuBias& bias, double dt,
                       ImuIncrement& x) {
  const Eigen::Vector3d phi = (0.5 * (s0.gyro_rad_s + s1.gyro_rad_s) - bias.gyro_rad_s) * dt;
  const Eigen::Matrix3d dR = core::exp_so3(phi);
  const Eigen::Matrix3d R1 = x.R * dR;
  const Eigen::Vector3d f0 = s0.accel_m_s2 - bias.accel_m_s2;
  const Eigen::Vector3d f1 = s1.accel_m_s2 - bias.accel_m_s2;
  const Eigen::Vector3d f1_start = dR * f1;  // R1 [f1]x dR^T = R0 [dR f1]x
  const Eigen::Vector3d a = 0.5 * (x.R * (f0 + f1_start));
  ImuStep step;
  step.dt = dt;
  step.dR_T = dR.transpose();
  step.Jr_dt = core::right_jacobian(phi) * dt;
  step.H = 0.5 * times_skew(x.R, f0 + f1_start);
  step.G.noalias() = 0.5 * times_skew(R1, f1) * step.Jr_dt;
  step.M = 0.5 * (x.R + R1);

  Eigen::Matrix3d a_bg = step.G;
  a_bg.noalias() -= step.H * x.R_bg;
  Eigen::Matrix3d R_bg = -step.Jr_dt;
  R_bg.noalias() += step.dR_T * x.R_bg;
  const double half_dt2 = 0.5 * dt * dt;
  x.p_bg += dt * x.v_bg + half_dt2 * a_bg;
  x.p_ba += dt * x.v_ba - half_dt2 * step.M;
  x.v_bg += dt * a_bg;
  x.v_ba -= dt * step.M;
  x.R_bg = R_bg;
  x.p += dt * x.v + half_dt2 * a;
  x.v += dt * a;
  x.R = R1;
  return step;
}

// The state at samples[from], carried to samples[to] (earlier or later) with its own biases:
//   p' = p + v dt + g dt^2/2 + R dp,   v' = v + g dt + R dv,   R' = R dR
inline core::State carry(const core::State& state, std::span<const core::ImuSample> samples, std::size_t from,
                         std::size_t to, double gravity_m_s2) {
  ImuIncrement x;
  for (std::size_t i = from; i != to;) {
    const std::size_t next = to > from ? i + 1 : i - 1;
    advance(samples[i], samples[next], state.bias, core::to_seconds(samples[next].t_ns - samples[i].t_ns), x);
    i = next;
  }
  const double dt = core::to_seconds(samples[to].t_ns - samples[from].t_ns);
  const Eigen::Vector3d gravity_W(0.0, 0.0, -gravity_m_s2);
  core::State result = state;
  result.T_W_B.p += dt * state.v_W + 0.5 * dt * dt * gravity_W + state.T_W_B.q * x.p;
  result.T_W_B.q = (state.T_W_B.q * Eigen::Quaterniond(x.R)).normalized();
  result.v_W += dt * gravity_W + state.T_W_B.q * x.v;
  return result;
}

}  // namespace plumbline::estimator
