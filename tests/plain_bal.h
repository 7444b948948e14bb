// Reprojection in a BAL camera as estimator/factors/bal_factors.h states it, plainly and for any scalar.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "core/lie.h"

namespace plumbline::testing {

using core::Vector3;

// camera [ w | t | f k1 k2 ], by quaternion; s = -1 in files of BAL.
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
