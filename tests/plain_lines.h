// Line residuals as their headers state them, plainly and for any scalar, for automatic differentiation in tests and
// benchmarks. With a lens the picture is linear about the observed end: the model of
// estimator/factors/line_residual.h.
#pragma once

#include <array>
#include <cmath>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "core/camera.h"
#include "plain_camera.h"
#include "plain_motion.h"

namespace plumbline::testing {

// Two points of the line in the world, a unit apart, from the block [ U | w1 w2 ] about the origin o. The first is the
// nearest to o: P with P x u2 = u1 w1/w2 and P perpendicular to u2.
template <class T>
std::array<Vector3<T>, 2> plain_line_points(const T* block, const Eigen::Vector3d& origin_W) {
  const Eigen::Matrix<T, 3, 3> U = Eigen::Quaternion<T>(block[3], block[0], block[1], block[2]).toRotationMatrix();
  const Vector3<T> d = U.col(1);
  const Vector3<T> P = origin_W.cast<T>() + d.cross(U.col(0)) * (block[4] / block[5]);
  return {P, P + d};
}

// The normal of the plane through the line and the camera, from the images of two points: no Pluecker coordinates. On
// the side of C x D.
template <class T>
Vector3<T> plain_normal(const PlainPose<T>& T_W_C, const std::array<Vector3<T>, 2>& points_W) {
  return T_W_C.to_inner(points_W[0]).cross(T_W_C.to_inner(points_W[1]));
}

// The ends of an observed segment and the noise of their pixels.
struct PlainSegment {
  PlainSegment(const core::PinholeCamera& camera, double pixel_sigma_px, const std::array<Eigen::Vector2d, 2>& observed)
      : ends{PlainSight(camera, observed[0]), PlainSight(camera, observed[1])},
        sigma_px(pixel_sigma_px),
        rows(camera.height_px) {}

  // (v - rows/2)/rows
  template <class T>
  T phase(const T& v) const {
    return (v - T(0.5 * rows)) / T(rows);
  }

  // The distance in pixels of a bearing from the line n.b = 0, in the picture about end k.
  template <class T>
  T distance(std::size_t k, const Vector3<T>& n, const Vector3<T>& bearing) const {
    const Vector2<T> l = ends[k].D.transpose().cast<T>() * n.template head<2>();
    return n.dot(bearing) / l.norm();
  }

  std::array<PlainSight, 2> ends;
  double sigma_px;
  double rows;
};

// estimator/factors/line_factors.h, CameraLineFactor
struct PlainCameraLine {
  PlainSegment segment;
  Eigen::Vector3d origin_W;

  template <class T>
  bool operator()(const T* T_W_C, const T* line, T* residual) const {
    const Vector3<T> n = plain_normal(PlainPose<T>(T_W_C), plain_line_points(line, origin_W));
    for (std::size_t k = 0; k < 2; ++k) {
      residual[k] = segment.distance<T>(k, n, segment.ends[k].b.cast<T>()) / T(segment.sigma_px);
    }
    return true;
  }
};

// VelocityLineFactor
struct PlainVelocityLine {
  PlainSegment segment;
  Eigen::Vector3d origin_W;
  std::array<Eigen::Vector2d, 2> velocities;
  double td_k_s;

  template <class T>
  bool operator()(const T* state, const T* T_B_C, const T* td, const T* readout, const T* line, T* residual) const {
    const Vector3<T> n = plain_normal(PlainPose<T>(state) * PlainPose<T>(T_B_C), plain_line_points(line, origin_W));
    for (std::size_t k = 0; k < 2; ++k) {
      const T shift = *td - T(td_k_s) + segment.phase(T(segment.ends[k].pixel.y())) * *readout;
      Vector3<T> b = segment.ends[k].b.cast<T>();
      b.x() -= shift * T(velocities[k].x());
      b.y() -= shift * T(velocities[k].y());
      residual[k] = segment.distance<T>(k, n, b) / T(segment.sigma_px);
    }
    return true;
  }
};

// estimator/factors/timed_line.h: the distance of end k from the curve F(u, v) = 0 over sigma, pose(v) the camera's as
// row v is exposed. The foot is found by steps to the curve's tangent; dF/dv comes from differences a pixel wide, which
// is enough, since an error of the normal's direction enters the distance by its square only.
template <class T, class PoseOfRow>
T plain_curve_distance(const PlainSegment& segment, std::size_t k, const std::array<Vector3<T>, 2>& points_W,
                       const PoseOfRow& pose) {
  const PlainSight& end = segment.ends[k];
  const auto normal = [&](const T& v) -> Vector3<T> { return plain_normal(pose(v), points_W); };
  Vector2<T> offset = Vector2<T>::Zero();  // of the foot from the observed end
  T r(0);
  for (int iteration = 0; iteration < 6; ++iteration) {
    const auto F = [&](const Vector2<T>& at) -> T {
      Vector3<T> b = end.b.cast<T>();
      b.template head<2>() += end.D.cast<T>() * at;
      return normal(T(end.pixel.y()) + at.y()).dot(b);
    };
    const Vector2<T> down(T(0), T(1));
    const Vector3<T> n = normal(T(end.pixel.y()) + offset.y());
    const Vector2<T> gradient(n.x() * T(end.D(0, 0)) + n.y() * T(end.D(1, 0)),
                              (F(offset + down) - F(offset - down)) / T(2));
    r = (F(offset) - gradient.dot(offset)) / gradient.norm();
    offset = -gradient * (r / gradient.norm());
  }
  return r / T(segment.sigma_px);
}

// PropagatedLineFactor
struct PlainPropagatedLine {
  PlainSegment segment;
  Eigen::Vector3d origin_W;
  PlainFrame frame;

  template <class T>
  bool operator()(const T* state, const T* T_B_C, const T* td, const T* readout, const T* line, T* residual) const {
    const auto pose = [&](const T& v) {
      const T tau = T(frame.offset_s) + *td + segment.phase(v) * *readout;
      return frame.at(PlainState<T>(state), tau) * PlainPose<T>(T_B_C);
    };
    for (std::size_t k = 0; k < 2; ++k) {
      residual[k] = plain_curve_distance<T>(segment, k, plain_line_points(line, origin_W), pose);
    }
    return true;
  }
};

}  // namespace plumbline::testing
