// Inertial and prior residuals as their headers state them, plainly and for any scalar: what automatic differentiation
// holds the analytic factors against, in tests and benchmarks. Nothing here is shared with the factors but core/lie.h
// and the data.
#pragma once

#include <Eigen/Core>

#include "core/lie.h"
#include "core/state.h"
#include "estimator/factors/preintegration.h"
#include "plain_motion.h"

namespace plumbline::testing {

// estimator/factors/imu_factor.h
struct PlainImuResidual {
  estimator::Preintegration z;
  double gravity_m_s2;

  template <class T>
  bool operator()(const T* x_i, const T* x_j, T* residual) const {
    const PlainState<T> i(x_i);
    const PlainState<T> j(x_j);
    const Vector3<T> g(T(0), T(0), T(-gravity_m_s2));
    const T dt(z.dt_s);
    const Vector3<T> d_bg = i.b_g - z.bias.gyro_rad_s.cast<T>();
    const Vector3<T> d_ba = i.b_a - z.bias.accel_m_s2.cast<T>();
    const estimator::ImuIncrement& x = z.increment;
    const Vector3<T> dp = x.p.cast<T>() + x.p_bg.cast<T>() * d_bg + x.p_ba.cast<T>() * d_ba;
    const Vector3<T> dv = x.v.cast<T>() + x.v_bg.cast<T>() * d_bg + x.v_ba.cast<T>() * d_ba;
    const Vector3<T> correction = x.R_bg.cast<T>() * d_bg;
    const Eigen::Quaternion<T> dR = Eigen::Quaterniond(x.R).cast<T>() * core::exp_quaternion(correction);
    const Eigen::Quaternion<T> turned = dR.conjugate() * i.q.conjugate() * j.q;
    Eigen::Matrix<T, core::kStateDof, 1> r;
    r << i.q.conjugate() * (j.p - i.p - i.v * dt - g * (T(0.5) * dt * dt)) - dp, core::log_so3(turned),
        i.q.conjugate() * (j.v - i.v - g * dt) - dv, j.b_g - i.b_g, j.b_a - i.b_a;
    Eigen::Map<Eigen::Matrix<T, core::kStateDof, 1>> whitened(residual);
    whitened = z.sqrt_information.cast<T>() * r;
    return true;
  }
};

// estimator/factors/prior_factors.h
struct PlainStatePrior {
  core::State mean;
  core::StateTangent sigma;

  template <class T>
  bool operator()(const T* x, T* residual) const {
    const PlainState<T> s(x);
    const Eigen::Quaternion<T> turned = s.q.conjugate() * mean.T_W_B.q.cast<T>();
    Eigen::Matrix<T, core::kStateDof, 1> r;
    r << mean.T_W_B.p.cast<T>() - s.p, core::log_so3(turned), mean.v_W.cast<T>() - s.v,
        mean.bias.gyro_rad_s.cast<T>() - s.b_g, mean.bias.accel_m_s2.cast<T>() - s.b_a;
    Eigen::Map<Eigen::Matrix<T, core::kStateDof, 1>> whitened(residual);
    whitened = r.cwiseQuotient(sigma.cast<T>());
    return true;
  }
};

struct PlainExtrinsicsPrior {
  core::Pose mean;
  double position_sigma_m;
  double rotation_sigma_rad;

  template <class T>
  bool operator()(const T* x, T* residual) const {
    const PlainPose<T> T_B_C(x);
    const Eigen::Quaternion<T> turned = T_B_C.q.conjugate() * mean.q.cast<T>();
    Eigen::Map<Eigen::Matrix<T, 6, 1>> whitened(residual);
    whitened << (mean.p.cast<T>() - T_B_C.p) / T(position_sigma_m), core::log_so3(turned) / T(rotation_sigma_rad);
    return true;
  }
};

struct PlainScalarPrior {
  double mean;
  double sigma;

  template <class T>
  bool operator()(const T* x, T* residual) const {
    residual[0] = (T(mean) - x[0]) / T(sigma);
    return true;
  }
};

struct PlainIntrinsicsPrior {
  Eigen::Vector4d mean;
  Eigen::Vector4d sigma;

  template <class T>
  bool operator()(const T* x, T* residual) const {
    for (int i = 0; i < 4; ++i) residual[i] = (T(mean[i]) - x[i]) / T(sigma[i]);
    return true;
  }
};

}  // namespace plumbline::testing
