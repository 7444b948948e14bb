// Line and bundle residuals as their headers state them, plainly and for any scalar, for automatic differentiation in
// tests and benchmarks. Nothing here is shared with the factors but core/lie.h, core/camera.h and the data.
#pragma once

#include <array>
#include <cmath>
#include <memory>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "core/camera.h"
#include "core/lie.h"
#include "core/measurements.h"
#include "core/time.h"
#include "plain_factors.h"

namespace plumbline::testing {

// T_W_B as a parameter block [ p | q ].
template <class T>
struct PlainTransform {
  Eigen::Quaternion<T> q;
  Vector3<T> p;

  explicit PlainTransform(const T* x) : q(x[6], x[3], x[4], x[5]), p(x[0], x[1], x[2]) {}
  PlainTransform(const Eigen::Quaternion<T>& rotation, const Vector3<T>& position) : q(rotation), p(position) {}
  PlainTransform operator*(const PlainTransform& b) const { return {q * b.q, q * b.p + p}; }
  Vector3<T> to_inner(const Vector3<T>& x) const { return q.conjugate() * (x - p); }
};

// Two points of the line in the world, a unit apart, from the block [ U | w1 w2 ] about the origin o. The first is the
// nearest to o: P with P x u2 = u1 w1/w2 and P perpendicular to u2.
template <class T>
std::array<Vector3<T>, 2> plain_line_points(const T* block, const Eigen::Vector3d& origin_W) {
  const Eigen::Matrix<T, 3, 3> U = Eigen::Quaternion<T>(block[3], block[0], block[1], block[2]).toRotationMatrix();
  const Vector3<T> d = U.col(1);
  const Vector3<T> P = origin_W.cast<T>() + d.cross(U.col(0)) * (block[4] / block[5]);
  return {P, P + d};
}

// The signed distance of a pixel from the image of the line through two points of the camera, without a lens: through
// the images of the points, so that no Pluecker coordinates are needed. On the side of C x D.
template <class T>
T plain_distance(const core::PinholeCamera& camera, const Vector3<T>& C, const Vector3<T>& D,
                 const Vector3<T>& bearing) {
  const Vector3<T> n = C.cross(D);
  // The image line l, l.s = 0: l = K^-T n, whose first two entries are its normal.
  const T l1 = n.x() / T(camera.fx_px);
  const T l2 = n.y() / T(camera.fy_px);
  using std::sqrt;
  return n.dot(bearing) / sqrt(l1 * l1 + l2 * l2);
}

template <class T>
Vector3<T> plain_bearing(const core::PinholeCamera& camera, const T& u, const T& v) {
  return {(u - T(camera.cx_px)) / T(camera.fx_px), (v - T(camera.cy_px)) / T(camera.fy_px), T(1)};
}

// estimator/factors/line_factors.h, CameraLineFactor; no lens
struct PlainCameraLine {
  core::PinholeCamera camera;
  double sigma_px;
  Eigen::Vector3d origin_W;
  std::array<Eigen::Vector2d, 2> observed;

  template <class T>
  bool operator()(const T* T_W_C, const T* line, T* residual) const {
    const PlainTransform<T> pose(T_W_C);
    const auto points = plain_line_points(line, origin_W);
    for (std::size_t k = 0; k < 2; ++k) {
      const Vector3<T> b = plain_bearing(camera, T(observed[k].x()), T(observed[k].y()));
      residual[k] = plain_distance(camera, pose.to_inner(points[0]), pose.to_inner(points[1]), b) / T(sigma_px);
    }
    return true;
  }
};

// VelocityLineFactor; no lens
struct PlainVelocityLine {
  core::PinholeCamera camera;
  double sigma_px;
  Eigen::Vector3d origin_W;
  std::array<Eigen::Vector2d, 2> observed;
  std::array<Eigen::Vector2d, 2> velocities;
  double td_k_s;

  template <class T>
  bool operator()(const T* state, const T* T_B_C, const T* td, const T* readout, const T* line, T* residual) const {
    const PlainTransform<T> pose = PlainTransform<T>(state) * PlainTransform<T>(T_B_C);
    const auto points = plain_line_points(line, origin_W);
    for (std::size_t k = 0; k < 2; ++k) {
      const double row = observed[k].y();
      const T shift = *td - T(td_k_s) + T((row - 0.5 * camera.height_px) / camera.height_px) * *readout;
      Vector3<T> b = plain_bearing(camera, T(observed[k].x()), T(row));
      b.x() -= shift * T(velocities[k].x());
      b.y() -= shift * T(velocities[k].y());
      residual[k] = plain_distance(camera, pose.to_inner(points[0]), pose.to_inner(points[1]), b) / T(sigma_px);
    }
    return true;
  }
};

// The body at tau after a state: carried by midpoint steps to the last sample before tau, and from there by a step of
// its own length, the samples linear within it (estimator/factors/local_motion.h).
struct PlainCarriedBody {
  std::shared_ptr<const std::vector<core::ImuSample>> samples;
  std::size_t state_index = 0;
  double gravity_m_s2 = 9.81;

  template <class T>
  struct Body {
    Eigen::Quaternion<T> q;
    Vector3<T> p;
  };

  template <class T>
  Body<T> at(const T* state, const T& tau) const {
    const std::vector<core::ImuSample>& z = *samples;
    const auto time = [&](std::size_t i) { return core::to_seconds(z[i].t_ns - z[state_index].t_ns); };
    std::size_t last = state_index;
    while (tau < T(time(last))) --last;
    while (last + 2 < z.size() && tau >= T(time(last + 1))) ++last;

    const PlainState<T> s(state);
    Body<T> body{s.q, s.p};
    Vector3<T> v = s.v;
    const Vector3<T> g(T(0), T(0), T(-gravity_m_s2));
    const auto gyro = [&](std::size_t i) -> Vector3<T> { return z[i].gyro_rad_s.cast<T>() - s.b_g; };
    const auto force = [&](std::size_t i) -> Vector3<T> { return z[i].accel_m_s2.cast<T>() - s.b_a; };
    const auto step = [&](std::size_t from, std::size_t to, const T& dt) {
      const T share = dt / T(time(to) - time(from));  // of the way to the other sample
      const Vector3<T> w = gyro(from) + (gyro(to) - gyro(from)) * (share * T(0.5));
      const Vector3<T> phi = w * dt;
      const Eigen::Quaternion<T> q1 = body.q * core::exp_quaternion(phi);
      const Vector3<T> f1 = force(from) + (force(to) - force(from)) * share;
      const Vector3<T> a = (body.q * force(from) + q1 * f1) * T(0.5) + g;
      body.p += v * dt + a * (dt * dt * T(0.5));
      v += a * dt;
      body.q = q1;
    };
    for (std::size_t i = state_index; i != last;) {
      const std::size_t next = last > i ? i + 1 : i - 1;
      step(i, next, T(time(next) - time(i)));
      i = next;
    }
    step(last, last + 1, T(tau - T(time(last))));
    return body;
  }
};

// PropagatedLineFactor; no lens. `Body` gives the body at tau from a state block: at(state, tau) -> {q, p}. The foot on
// the curve F(u, v) = 0 is found by steps to its tangent; dF/dv comes from differences a pixel wide, which is enough,
// since an error of the normal's direction enters the distance by its square only.
template <class Body>
struct PlainPropagatedLine {
  core::PinholeCamera camera;
  double sigma_px;
  Eigen::Vector3d origin_W;
  std::array<Eigen::Vector2d, 2> observed;
  double offset_s;
  Body body;

  template <class T>
  bool operator()(const T* state, const T* T_B_C, const T* td, const T* readout, const T* line, T* residual) const {
    using std::sqrt;
    const auto points = plain_line_points(line, origin_W);
    const PlainTransform<T> extrinsics(T_B_C);
    for (std::size_t k = 0; k < 2; ++k) {
      const T s_u(observed[k].x());
      const T s_v(observed[k].y());
      // The normal of the line as row v sees it.
      const auto normal = [&](const T& v) -> Vector3<T> {
        const T phase = (v - T(0.5 * camera.height_px)) / T(camera.height_px);
        const auto [q, p] = body.at(state, T(T(offset_s) + *td + phase * *readout));
        const PlainTransform<T> pose = PlainTransform<T>(q, p) * extrinsics;
        return pose.to_inner(points[0]).cross(pose.to_inner(points[1]));
      };
      T u = s_u;
      T v = s_v;
      T r(0);
      for (int iteration = 0; iteration < 6; ++iteration) {
        const auto F = [&](const T& row) -> T { return normal(row).dot(plain_bearing(camera, u, row)); };
        const T g_u = normal(v).x() / T(camera.fx_px);
        const T g_v = (F(v + T(1)) - F(v - T(1))) / T(2);
        const T m = sqrt(g_u * g_u + g_v * g_v);
        r = (F(v) + g_u * (s_u - u) + g_v * (s_v - v)) / m;
        u = s_u - r * g_u / m;
        v = s_v - r * g_v / m;
      }
      residual[k] = r / T(sigma_px);
    }
    return true;
  }
};

// estimator/factors/bal_factors.h: camera [ w | t | f k1 k2 ], by quaternion; s = -1 in files of BAL.
struct PlainBal {
  Eigen::Vector2d observed_px;
  double s = -1.0;

  template <class T>
  bool operator()(const T* camera, const T* point, T* residual) const {
    const Vector3<T> w(camera[0], camera[1], camera[2]);
    return project(core::exp_quaternion(w), camera + 3, point, residual);
  }

  template <class T>
  bool project(const Eigen::Quaternion<T>& q, const T* t_f_k, const T* point, T* residual) const {
    const Vector3<T> P = q * Vector3<T>(point[0], point[1], point[2]) + Vector3<T>(t_f_k[0], t_f_k[1], t_f_k[2]);
    const T x = T(s) * P.x() / P.z();
    const T y = T(s) * P.y() / P.z();
    const T r2 = x * x + y * y;
    const T scale = t_f_k[3] * (T(1) + t_f_k[4] * r2 + t_f_k[5] * r2 * r2);
    residual[0] = scale * x - T(observed_px.x());
    residual[1] = scale * y - T(observed_px.y());
    return true;
  }
};

// camera [ q | t | f k1 k2 ]
struct PlainBalLeft : PlainBal {
  template <class T>
  bool operator()(const T* camera, const T* point, T* residual) const {
    return project(Eigen::Quaternion<T>(camera[3], camera[0], camera[1], camera[2]), camera + 4, point, residual);
  }
};

}  // namespace plumbline::testing
