// The picture of a camera and its inverse as core/camera.h states them, plainly and for any scalar; the inverse by
// iteration.
#pragma once

#include <cmath>

#include <Eigen/Core>
#include <ceres/jet.h>

#include "core/camera.h"
#include "core/lie.h"

namespace plumbline::testing {

template <class T>
using Vector2 = Eigen::Matrix<T, 2, 1>;
using core::Vector3;

inline double value_of(double x) { return x; }
template <class S, int N>
S value_of(const ceres::Jet<S, N>& x) {
  return x.a;
}

// core/distortion.h; the equidistant lens off its axis only.
template <class T>
Vector2<T> plain_distort(const core::Distortion& lens, const Vector2<T>& xy) {
  using std::atan;
  using std::sqrt;
  const auto k = [&](std::size_t i) { return T(lens.coefficients()[i]); };
  const T& x = xy.x();
  const T& y = xy.y();
  const T r2 = x * x + y * y;
  switch (lens.model()) {
    case core::DistortionModel::kNone:
      break;
    case core::DistortionModel::kRadtan: {
      const T d = T(1) + k(0) * r2 + k(1) * r2 * r2;
      return {d * x + T(2) * k(2) * x * y + k(3) * (r2 + T(2) * x * x),
              d * y + k(2) * (r2 + T(2) * y * y) + T(2) * k(3) * x * y};
    }
    case core::DistortionModel::kEquidistant: {
      const T r = sqrt(r2);
      const T theta = atan(r);
      const T s = theta * theta;
      return xy * (theta / r * (T(1) + k(0) * s + k(1) * s * s + k(2) * s * s * s + k(3) * s * s * s * s));
    }
  }
  return xy;
}

template <class T>
Vector2<T> plain_pixel(const core::PinholeCamera& c, const Vector3<T>& q) {
  const Vector2<T> seen = plain_distort<T>(c.distortion, {q.x() / q.z(), q.y() / q.z()});
  return {T(c.fx_px) * seen.x() + T(c.cx_px), T(c.fy_px) * seen.y() + T(c.cy_px)};
}

// By adding what is missing until nothing is: lenses shrink the error by a half or more each time.
template <class T>
Vector3<T> plain_bearing(const core::PinholeCamera& c, const Vector2<T>& pixel) {
  const Vector2<T> seen((pixel.x() - T(c.cx_px)) / T(c.fx_px), (pixel.y() - T(c.cy_px)) / T(c.fy_px));
  Vector2<T> xy = seen;
  if (c.distortion.model() != core::DistortionModel::kNone) {
    for (int i = 0; i < 100; ++i) xy += seen - plain_distort<T>(c.distortion, xy);
  }
  return {xy.x(), xy.y(), T(1)};
}

// The bearing that a pixel sees, and its derivative D = d(x, y)/d(u, v).
struct PlainSight {
  PlainSight(const core::PinholeCamera& camera, const Eigen::Vector2d& seen_px) : pixel(seen_px) {
    using Jet = ceres::Jet<double, 2>;
    const Vector3<Jet> moved = plain_bearing<Jet>(camera, {Jet(pixel.x(), 0), Jet(pixel.y(), 1)});
    b << moved.x().a, moved.y().a, 1.0;
    D << moved.x().v.transpose(), moved.y().v.transpose();
  }

  Eigen::Vector2d pixel;
  Eigen::Vector3d b;
  Eigen::Matrix2d D;
};

}  // namespace plumbline::testing
