// A trajectory spline and what is fitted to it, plainly and for any scalar, for automatic differentiation in tests. The
// basis is by the recursion of de Boor and Cox, rates by differentiating it; nothing is shared with the factors but
// core/lie.h.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <ceres/jet.h>

#include "core/lie.h"
#include "core/measurements.h"
#include "core/state.h"
#include "plain_camera.h"
#include "plain_lines.h"
#include "plain_motion.h"
#include "plain_points.h"

namespace plumbline::testing {

// The values of the order's basis on a segment with knots at the whole numbers, u from its beginning:
//   N_i^d(u) = (u - i)/d N_i^{d-1}(u) + (i + d + 1 - u)/d N_{i+1}^{d-1}(u)
template <class T>
std::vector<T> plain_basis(int order, const T& u) {
  std::vector<T> b = {T(1)};
  for (int d = 1; d < order; ++d) {
    std::vector<T> next;
    for (int j = 0; j <= d; ++j) {
      T sum(0);
      if (j > 0) sum += (u - T(j - d)) / T(d) * b[static_cast<std::size_t>(j) - 1];
      if (j < d) sum += (T(j + 1) - u) / T(d) * b[static_cast<std::size_t>(j)];
      next.push_back(sum);
    }
    b = next;
  }
  return b;
}

// d/du of it: N_i^{d-1} - N_{i+1}^{d-1}, `times` over.
template <class T>
std::vector<T> plain_basis(int order, const T& u, int times) {
  if (times == 0) return plain_basis(order, u);
  const std::vector<T> lower = plain_basis(order - 1, u, times - 1);
  std::vector<T> b(static_cast<std::size_t>(order), T(0));
  for (std::size_t j = 0; j < lower.size(); ++j) {
    b[j] -= lower[j];
    b[j + 1] += lower[j];
  }
  return b;
}

// A segment of a spline; its controls are blocks of poses.
struct PlainSegmentPath {
  int order;
  double interval_s;
  int segment;
  std::vector<std::size_t> controls;  // which of the blocks

  template <class T>
  T u(const T& t) const {
    return t / T(interval_s) - T(segment);
  }
  template <class T>
  PlainPose<T> control(T const* const* blocks, std::size_t j) const {
    return PlainPose<T>(blocks[controls[j]]);
  }
  template <class T>
  Vector3<T> position(T const* const* blocks, const T& t, int derivative) const {
    const std::vector<T> b = plain_basis(order, u(t), derivative);
    Vector3<T> p = Vector3<T>::Zero();
    for (std::size_t j = 0; j < b.size(); ++j) p += b[j] * control(blocks, j).p;
    return p / T(std::pow(interval_s, derivative));
  }
  // R_0 prod Exp(lambda_j d_j), lambda_j the sum of the basis from j on, and its body rate.
  template <class T>
  Eigen::Quaternion<T> rotation(T const* const* blocks, const T& t, Vector3<T>* rate = nullptr) const {
    const std::vector<T> b = plain_basis(order, u(t));
    const std::vector<T> b_dot = plain_basis(order, u(t), 1);
    Eigen::Quaternion<T> q = control(blocks, 0).q;
    Vector3<T> omega = Vector3<T>::Zero();
    for (std::size_t j = 1; j < b.size(); ++j) {
      T lambda(0);
      T lambda_dot(0);
      for (std::size_t s = j; s < b.size(); ++s) {
        lambda += b[s];
        lambda_dot += b_dot[s] / T(interval_s);
      }
      const Eigen::Quaternion<T> between = control(blocks, j - 1).q.conjugate() * control(blocks, j).q;
      const Vector3<T> d = core::log_so3(between);
      const Vector3<T> turned = lambda * d;
      const Eigen::Quaternion<T> A = core::exp_quaternion(turned);
      q = q * A;
      omega = Vector3<T>(A.conjugate() * omega) + lambda_dot * d;
    }
    if (rate != nullptr) *rate = omega;
    return q;
  }
  template <class T>
  PlainPose<T> at(T const* const* blocks, const T& t) const {
    return {rotation(blocks, t), position(blocks, t, 0)};
  }
};

// estimator/factors/spline_factors.h, SplinePoint
struct PlainSplinePoint {
  PlainReduction reduction;
  std::array<PlainSegmentPath, 2> ends;  // anchor, observer
  std::array<double, 2> t_cam_s;
  std::size_t controls;  // blocks of them
  Eigen::Vector2d observed_pixel;
  std::optional<Eigen::Vector2d> anchor_pixel = std::nullopt;  // where the bearing is fixed

  template <class T>
  bool operator()(T const* const* x, T* residual) const {
    // In double; then one step of Newton's in the scalar, which knows the derivatives.
    std::vector<std::vector<double>> numbers;
    std::vector<const double*> plain;
    for (std::size_t b = 0; b < controls + 4; ++b) {
      const std::size_t size = b <= controls ? 7 : b < controls + 3 ? 1 : anchor_pixel ? 1 : 3;
      std::vector<double>& block = numbers.emplace_back();
      for (std::size_t k = 0; k < size; ++k) block.push_back(value_of(x[b][k]));
    }
    for (const auto& block : numbers) plain.push_back(block.data());
    double row = observed_pixel.y();
    double slope = 1.0;
    for (int i = 0; i < 20; ++i) {
      using Jet = ceres::Jet<double, 1>;
      std::vector<std::vector<Jet>> jets;
      std::vector<const Jet*> pointers;
      for (const auto& block : numbers) jets.emplace_back(block.begin(), block.end());
      for (const auto& block : jets) pointers.push_back(block.data());
      const Jet v = plain_pixel(reduction.camera, ray(pointers.data(), Jet(row, 0))).y();
      slope = 1.0 - v.v[0];
      row += (v.a - row) / slope;
    }
    const T defect = plain_pixel(reduction.camera, ray(x, T(row))).y() - T(row);
    const Vector3<T> q = ray(x, T(row) + defect / T(slope));
    Eigen::Map<Vector2<T>> r(residual);
    r = reduction(q, Vector3<T>(plain_bearing<double>(reduction.camera, observed_pixel).cast<T>()));
    return true;
  }

 private:
  template <class T>
  Vector3<T> ray(T const* const* x, const T& row) const {
    std::optional<Eigen::Vector3d> fixed;
    if (anchor_pixel) fixed = plain_bearing<double>(reduction.camera, *anchor_pixel);
    const PlainLandmark<T> l(x[controls + 3], fixed);
    const T anchor_row = anchor_pixel ? T(anchor_pixel->y()) : plain_pixel(reduction.camera, l.b).y();
    const auto time = [&](std::size_t k, const T& v) {
      const double rows = reduction.camera.height_px;
      return T(t_cam_s[k]) + *x[controls + 1] + (v - T(rows / 2.0)) / T(rows) * *x[controls + 2];
    };
    const PlainPose<T> c(x[controls]);
    return plain_transfer(l, c, c, ends[0].at(x, time(0, anchor_row)), ends[1].at(x, time(1, row)));
  }
};

// SplineLine, as PlainPropagatedLine.
struct PlainSplineLine {
  PlainSegment segment;
  Eigen::Vector3d origin_W;
  std::array<PlainSegmentPath, 2> ends;
  double t_cam_s;
  std::size_t controls;

  template <class T>
  bool operator()(T const* const* x, T* residual) const {
    const PlainPose<T> T_B_C(x[controls]);
    for (std::size_t k = 0; k < 2; ++k) {
      const auto pose = [&](const T& v) {
        return ends[k].at(x, T(t_cam_s) + *x[controls + 1] + segment.phase(v) * *x[controls + 2]) * T_B_C;
      };
      residual[k] = plain_curve_distance<T>(segment, k, plain_line_points(x[controls + 3], origin_W), pose);
    }
    return true;
  }
};

// SplineImu
struct PlainSplineImu {
  PlainSegmentPath path;
  double t_s;
  double bias_share;
  core::ImuSample sample;
  Eigen::Vector2d sigma;  // rad/s, m/s^2
  double gravity_m_s2;

  template <class T>
  bool operator()(T const* const* x, T* residual) const {
    const std::size_t n = path.controls.size();
    Vector3<T> omega;
    const Eigen::Quaternion<T> q = path.rotation(x, T(t_s), &omega);
    const Vector3<T> a = path.position(x, T(t_s), 2) + Vector3<T>(T(0), T(0), T(gravity_m_s2));
    const Vector3<T> f = q.conjugate() * a;
    for (std::size_t i = 0; i < 3; ++i) {
      const auto c = static_cast<int>(i);
      const auto bias = [&](std::size_t k) { return T(1.0 - bias_share) * x[n][k] + T(bias_share) * x[n + 1][k]; };
      residual[i] = (omega[c] + bias(i) - T(sample.gyro_rad_s[c])) / T(sigma[0]);
      residual[3 + i] = (f[c] + bias(3 + i) - T(sample.accel_m_s2[c])) / T(sigma[1]);
    }
    return true;
  }
};

// SplineState
struct PlainSplineState {
  PlainSegmentPath path;
  double t_s;
  double bias_share;
  core::State mean;
  core::StateTangent sigma;

  template <class T>
  bool operator()(T const* const* x, T* residual) const {
    const std::size_t n = path.controls.size();
    const Eigen::Quaternion<T> q = path.rotation(x, T(t_s));
    const Vector3<T> theta = core::log_so3(Eigen::Quaternion<T>(q.conjugate() * mean.T_W_B.q.cast<T>()));
    const Vector3<T> p = mean.T_W_B.p.cast<T>() - path.position(x, T(t_s), 0);
    const Vector3<T> v = mean.v_W.cast<T>() - path.position(x, T(t_s), 1);
    Eigen::Matrix<double, 6, 1> bias;
    bias << mean.bias.gyro_rad_s, mean.bias.accel_m_s2;
    Eigen::Matrix<T, core::kStateDof, 1> d;
    d << p, theta, v, Eigen::Matrix<T, 6, 1>::Zero();
    for (int i = 0; i < 6; ++i) d[9 + i] = T(bias[i]) - T(1.0 - bias_share) * x[n][i] - T(bias_share) * x[n + 1][i];
    for (int i = 0; i < core::kStateDof; ++i) residual[i] = d[i] / T(sigma[i]);
    return true;
  }
};

// BiasWalk
struct PlainBiasWalk {
  Eigen::Matrix<double, 6, 1> sigma;

  template <class T>
  bool operator()(const T* from, const T* to, T* residual) const {
    for (int i = 0; i < 6; ++i) residual[i] = (to[i] - from[i]) / T(sigma[i]);
    return true;
  }
};

}  // namespace plumbline::testing
