// Poses, states and the motion about a state, plainly and for any scalar. Nothing here is shared with the factors but
// core/lie.h and the data.
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "core/lie.h"
#include "core/measurements.h"
#include "core/time.h"
#include "plain_camera.h"

namespace plumbline::testing {

// T_A_B, from a parameter block [ p | q ... ] or from its parts.
template <class T>
struct PlainPose {
  Vector3<T> p;
  Eigen::Quaternion<T> q;

  explicit PlainPose(const T* x) : p(x[0], x[1], x[2]), q(x[6], x[3], x[4], x[5]) {}
  PlainPose(const Eigen::Quaternion<T>& rotation, const Vector3<T>& position) : p(position), q(rotation) {}
  PlainPose operator*(const PlainPose& b) const { return {q * b.q, q * b.p + p}; }
  Vector3<T> to_inner(const Vector3<T>& x) const { return q.conjugate() * (x - p); }
};

template <class T>
struct PlainState : PlainPose<T> {
  Vector3<T> v;
  Vector3<T> b_g;
  Vector3<T> b_a;
  explicit PlainState(const T* x)
      : PlainPose<T>(x), v(x[7], x[8], x[9]), b_g(x[10], x[11], x[12]), b_a(x[13], x[14], x[15]) {}
};

// A frame and the samples about its state.
struct PlainFrame {
  std::shared_ptr<const std::vector<core::ImuSample>> samples;
  std::size_t state_index = 0;
  double offset_s = 0.0;
  double gravity_m_s2 = 9.81;

  // The body at tau: the state carried by midpoint steps to the last sample before tau, and from there by a step of its
  // own length, the samples linear within it (estimator/factors/local_motion.h).
  template <class T>
  PlainPose<T> at(const PlainState<T>& state, const T& tau) const {
    const std::vector<core::ImuSample>& z = *samples;
    const core::TimeNs t0 = z[state_index].t_ns;
    const auto time = [&](std::size_t i) { return core::to_seconds(z[i].t_ns - t0); };
    std::size_t last = state_index;
    while (time(last) > value_of(tau)) --last;
    while (last + 2 < z.size() && time(last + 1) <= value_of(tau)) ++last;

    Eigen::Quaternion<T> R = state.q;
    Vector3<T> v = state.v;
    Vector3<T> p = state.p;
    const Vector3<T> g(T(0), T(0), T(-gravity_m_s2));
    const auto step = [&](const Vector3<T>& w, const Vector3<T>& f0, const Vector3<T>& f1, const T& dt) {
      const Vector3<T> phi = w * dt;
      const Eigen::Quaternion<T> R1 = R * core::exp_quaternion(phi);
      const Vector3<T> a = T(0.5) * (R * f0 + R1 * f1) + g;
      p += v * dt + a * (T(0.5) * dt * dt);
      v += a * dt;
      R = R1;
    };
    const auto rate = [&](std::size_t i) -> Vector3<T> { return z[i].gyro_rad_s.cast<T>() - state.b_g; };
    const auto force = [&](std::size_t i) -> Vector3<T> { return z[i].accel_m_s2.cast<T>() - state.b_a; };
    for (std::size_t i = state_index; i != last;) {
      const std::size_t next = last > i ? i + 1 : i - 1;
      step(T(0.5) * (rate(i) + rate(next)), force(i), force(next), T(time(next) - time(i)));
      i = next;
    }
    const T u = tau - T(time(last));
    const T share = u / T(time(last + 1) - time(last));
    const Vector3<T> w_end = rate(last) + share * (rate(last + 1) - rate(last));
    const Vector3<T> f_end = force(last) + share * (force(last + 1) - force(last));
    step(T(0.5) * (rate(last) + w_end), force(last), f_end, u);
    return {R, p};
  }
};

}  // namespace plumbline::testing
