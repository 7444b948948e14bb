// Point residuals as MATH states them, plainly and for any scalar; companion of plain_factors.h. Motion over the gap to
// an observation is integrated sample by sample from the state (plain_motion.h), the row is found by iteration in
// double, and the derivative of that implicit solution is left to one more Newton step in the scalar.
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>
#include <Eigen/LU>
#include <ceres/jet.h>

#include "core/camera.h"
#include "estimator/factors/parameter_blocks.h"
#include "estimator/factors/ray_chart.h"
#include "plain_camera.h"
#include "plain_motion.h"

namespace plumbline::testing {

// r = S B (q/|q| - p/|p|) or (project(q) - project(p))/sigma, whitened about the observed pixel.
struct PlainReduction {
  PlainReduction(estimator::ResidualType residual, const core::PinholeCamera& c, double pixel_sigma_px,
                 const Eigen::Vector2d& pixel)
      : type(residual), camera(c), sigma_px(pixel_sigma_px) {
    using Jet = ceres::Jet<double, 2>;
    const Eigen::Vector3d p = plain_bearing<double>(camera, pixel);
    const Eigen::Vector3d a = p / p.norm();
    const Eigen::Vector3d b1 = (Eigen::Vector3d::UnitZ() - a * a.z()).normalized();
    SB << b1.transpose(), a.cross(b1).transpose();
    // S^-1 is the derivative of the point on the tangent plane with respect to the pixel, times its noise.
    const Vector3<Jet> moved = plain_bearing<Jet>(camera, {Jet(pixel.x(), 0), Jet(pixel.y(), 1)});
    const Vector2<Jet> on_plane = SB.cast<Jet>() * (moved / moved.norm());
    Eigen::Matrix2d inverse;
    inverse << on_plane.x().v.transpose(), on_plane.y().v.transpose();
    SB = (inverse * sigma_px).inverse() * SB;
  }

  template <class T>
  Vector2<T> operator()(const Vector3<T>& q, const Vector3<T>& p) const {
    if (type == estimator::ResidualType::kUnitSphere) return SB.cast<T>() * (q / q.norm() - p / p.norm());
    return (plain_pixel(camera, q) - plain_pixel(camera, p)) / T(sigma_px);
  }

  estimator::ResidualType type;
  core::PinholeCamera camera;
  double sigma_px;
  Eigen::Matrix<double, 2, 3> SB;
};

// The anchor's bearing and the inverse depth: estimated, or the bearing as observed.
template <class T>
struct PlainLandmark {
  Vector3<T> b;
  T lambda;
  PlainLandmark(const T* x, const std::optional<Eigen::Vector3d>& fixed)
      : b(fixed ? Vector3<T>(fixed->cast<T>()) : Vector3<T>(x[0], x[1], T(1))), lambda(fixed ? x[0] : x[2]) {}
};

// q = R_c^T (R_j^T (R_i (R_a b + lambda t_a) + lambda (t_i - t_j)) - lambda t_c), (R_a, t_a) the anchor's camera
template <class T>
Vector3<T> plain_transfer(const PlainLandmark<T>& l, const PlainPose<T>& a, const PlainPose<T>& c,
                          const PlainPose<T>& i, const PlainPose<T>& j) {
  const Vector3<T> P_bi = a.q * l.b + l.lambda * a.p;
  const Vector3<T> P_w = i.q * P_bi + l.lambda * i.p;
  const Vector3<T> P_bj = j.q.conjugate() * (P_w - l.lambda * j.p);
  return c.q.conjugate() * (P_bj - l.lambda * c.p);
}

// A camera that an anchor carries, as blocks of its numbers.
template <class T>
PlainPose<T> plain_carried(const core::Pose& T_B_A) {
  const Eigen::Matrix<T, 7, 1> x = estimator::pack(T_B_A).cast<T>();
  return PlainPose<T>(x.data());
}

// estimator/factors/point_factors.h, and anchored_point.h with a carried camera
struct PlainPropagatedPoint {
  PlainReduction reduction;
  PlainFrame anchor;
  PlainFrame observer;
  Eigen::Vector2d observed_pixel;
  std::optional<Eigen::Vector2d> anchor_pixel = std::nullopt;  // where the bearing is fixed
  std::optional<core::Pose> T_B_A = std::nullopt;              // where the anchor is its state

  template <class T>
  bool operator()(const T* x_i, const T* x_j, const T* x_c, const T* td, const T* readout, const T* x_l,
                  T* residual) const {
    const Row at = row_of(x_i, x_j, x_c, td, readout, x_l);
    const T defect = pixel(x_i, x_j, x_c, td, readout, x_l, T(at.row)).y() - T(at.row);
    const Vector3<T> q = ray(x_i, x_j, x_c, td, readout, x_l, T(at.row) + defect / T(at.slope));
    Eigen::Map<Vector2<T>> r(residual);
    r = reduction(q, Vector3<T>(plain_bearing<double>(reduction.camera, observed_pixel).cast<T>()));
    return true;
  }

  // The predicted row, and 1 - d(row of the point seen at its time)/d row.
  struct Row {
    double row;
    double slope = 1.0;
  };
  template <class T>
  Row row_of(const T* x_i, const T* x_j, const T* x_c, const T* td, const T* readout, const T* x_l) const {
    Row at{observed_pixel.y()};
    for (int i = 0; i < 20; ++i) {
      // With respect to the row alone.
      using Jet = ceres::Jet<double, 1>;
      const auto plain = [](const T* x, std::size_t n) {
        std::vector<Jet> y;
        for (std::size_t k = 0; k < n; ++k) y.emplace_back(value_of(x[k]));
        return y;
      };
      const Jet v = pixel<Jet>(plain(x_i, 16).data(), plain(x_j, 16).data(), plain(x_c, 7).data(), plain(td, 1).data(),
                               plain(readout, 1).data(), plain(x_l, anchor_pixel ? 1 : 3).data(), Jet(at.row, 0))
                        .y();
      at.slope = 1.0 - v.v[0];
      at.row += (v.a - at.row) / at.slope;
    }
    return at;
  }

  template <class T>
  Vector3<T> ray(const T* x_i, const T* x_j, const T* x_c, const T* td, const T* readout, const T* x_l,
                 const T& row) const {
    std::optional<Eigen::Vector3d> fixed;
    if (anchor_pixel) fixed = plain_bearing<double>(reduction.camera, *anchor_pixel);
    const PlainLandmark<T> l(x_l, fixed);
    const T anchor_row = plain_pixel(reduction.camera, l.b).y();
    const PlainPose<T> c(x_c);
    const PlainPose<T> j = observer.at(PlainState<T>(x_j), tau(observer, *td, *readout, row));
    if (T_B_A) return plain_transfer(l, plain_carried<T>(*T_B_A), c, PlainPose<T>(x_i), j);
    const PlainPose<T> i = anchor.at(PlainState<T>(x_i), tau(anchor, *td, *readout, anchor_row));
    return plain_transfer(l, c, c, i, j);
  }

 private:
  template <class T>
  T tau(const PlainFrame& frame, const T& td, const T& readout, const T& row) const {
    const double rows = reduction.camera.height_px;
    return T(frame.offset_s) + td + (row - T(rows / 2.0)) / T(rows) * readout;
  }

  template <class T>
  Vector2<T> pixel(const T* x_i, const T* x_j, const T* x_c, const T* td, const T* readout, const T* x_l,
                   const T& row) const {
    return plain_pixel(reduction.camera, ray(x_i, x_j, x_c, td, readout, x_l, row));
  }
};

// estimator/factors/anchored_point.h with the camera's (fx, fy, cx, cy) estimated; pixels, a carried camera.
struct PlainFreeCameraPoint {
  PlainPropagatedPoint plain;

  template <class T>
  bool operator()(const T* x_i, const T* x_j, const T* x_c, const T* td, const T* readout, const T* x_l, const T* K,
                  T* residual) const {
    const core::Distortion& lens = plain.reduction.camera.distortion;
    const auto seen = [&](const Vector3<T>& q) {
      const Vector2<T> xy = plain_distort<T>(lens, {q.x() / q.z(), q.y() / q.z()});
      return Vector2<T>(K[0] * xy.x() + K[2], K[1] * xy.y() + K[3]);
    };
    PlainPropagatedPoint fixed = plain;
    fixed.reduction.camera =
        plain.reduction.camera.with({value_of(K[0]), value_of(K[1]), value_of(K[2]), value_of(K[3])});
    const auto at = fixed.row_of(x_i, x_j, x_c, td, readout, x_l);
    const auto ray = [&](const T& row) { return fixed.ray(x_i, x_j, x_c, td, readout, x_l, row); };
    const T defect = seen(ray(T(at.row))).y() - T(at.row);
    Eigen::Map<Vector2<T>> r(residual);
    r = (seen(ray(T(at.row) + defect / T(at.slope))) - plain.observed_pixel.cast<T>()) / T(plain.reduction.sigma_px);
    return true;
  }
};

// An observation that moves by its image velocity.
struct PlainMovingBearing {
  core::PinholeCamera camera;
  double td_k_s;
  Eigen::Vector2d pixel;
  Eigen::Vector2d velocity;

  template <class T>
  Vector3<T> at(const T& td, const T& readout) const {
    const double rows = camera.height_px;
    const T shift = td - T(td_k_s) + T((pixel.y() - rows / 2.0) / rows) * readout;
    Vector3<T> p = plain_bearing<double>(camera, pixel).cast<T>();
    p.x() -= shift * T(velocity.x());
    p.y() -= shift * T(velocity.y());
    return p;
  }
};

// estimator/factors/feature_velocity.h, and anchored_point.h with a carried camera
struct PlainFeatureVelocityPoint {
  PlainReduction reduction;
  PlainMovingBearing observed;
  std::optional<PlainMovingBearing> anchor = std::nullopt;  // where the bearing is fixed
  std::optional<core::Pose> T_B_A = std::nullopt;           // where the anchor is its state

  template <class T>
  bool operator()(const T* x_i, const T* x_j, const T* x_c, const T* td, const T* readout, const T* x_l,
                  T* residual) const {
    PlainLandmark<T> l(x_l, anchor ? std::optional(Eigen::Vector3d(Eigen::Vector3d::UnitZ())) : std::nullopt);
    if (anchor) l.b = anchor->at(*td, *readout);
    const PlainPose<T> c(x_c);
    const PlainPose<T> a = T_B_A ? plain_carried<T>(*T_B_A) : c;
    const Vector3<T> q = plain_transfer(l, a, c, PlainPose<T>(x_i), PlainPose<T>(x_j));
    Eigen::Map<Vector2<T>> r(residual);
    r = reduction(q, observed.at(*td, *readout));
    return true;
  }
};

// estimator/factors/anchored_point.h where the observer is the anchor.
template <class Plain>
struct PlainOwn {
  Plain plain;

  template <class T, class... Rest>
  bool operator()(const T* x, Rest... rest) const {
    return plain(x, x, rest...);
  }
};

// The anchors' own observations.
struct PlainAnchorPoint {
  PlainReduction reduction;
  Eigen::Vector2d pixel;

  template <class T>
  bool operator()(const T* x, T* residual) const {
    Eigen::Map<Vector2<T>> r(residual);
    r = reduction(Vector3<T>(x[0], x[1], T(1)), Vector3<T>(plain_bearing<double>(reduction.camera, pixel).cast<T>()));
    return true;
  }
};

struct PlainFeatureVelocityAnchor {
  PlainReduction reduction;
  PlainMovingBearing observed;

  template <class T>
  bool operator()(const T* td, const T* readout, const T* x, T* residual) const {
    Eigen::Map<Vector2<T>> r(residual);
    r = reduction(Vector3<T>(x[0], x[1], T(1)), observed.at(*td, *readout));
    return true;
  }
};

}  // namespace plumbline::testing
