// The body on a segment of a cumulative B-spline (camera timing `spline`): positions in R^3, orientations by
// core/rotation_spline.h, from k control poses, one each knot interval h:
//   p(t) = sum_j B_j(u) p_j,   R(t) = R_0 prod_j Exp(lambda_j(u) Log(R_{j-1}^T R_j)),   u = t/h - segment
// Times count from the spline's origin; segment s lasts from s h to (s + 1) h and has the controls s .. s + k - 1.
// Outside of it the segment's own polynomials go on, which differ from the spline's by (overshoot/h)^(k-1): a factor
// keeps its controls while td and readout move its time a little.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include <Eigen/Core>

#include "core/rotation_spline.h"
#include "estimator/factors/timed_body.h"

namespace plumbline::estimator {

inline constexpr int kMostControls = core::bspline::kMostOrder;

struct SplineKnots {
  double interval_s = 0.1;    // h
  int order = kMostControls;  // k
  int segments = 1;

  int controls() const { return segments + order - 1; }
  double end_s() const { return segments * interval_s; }
  int segment(double t_s) const { return std::clamp(static_cast<int>(std::floor(t_s / interval_s)), 0, segments - 1); }
};

class SplinePath {
 public:
  // The blocks (parameter_blocks.h, poses) of the segment's controls.
  SplinePath(const SplineKnots& knots, int segment, double const* const* controls);

  // False where t_s is further than an interval from the segment.
  bool at(double t_s, TimedBody& body);
  Eigen::Vector3d acceleration() const { return acceleration_; }  // of the last time, world

  // Derivatives with respect to the body at the last time, and what becomes of them: those with respect to the
  // controls, [ p | theta ] each.
  template <int kRows>
  struct BodyRows {
    using Rows = Eigen::Matrix<double, kRows, 3>;
    Rows position = Rows::Zero();
    Rows theta = Rows::Zero();
    Rows velocity = Rows::Zero();
    Rows acceleration = Rows::Zero();
    Rows omega = Rows::Zero();
  };
  template <int kRows>
  using ControlRows = std::array<Eigen::Matrix<double, kRows, 6>, kMostControls>;
  template <int kRows>
  ControlRows<kRows> chain_to_controls(const BodyRows<kRows>& body) const {
    const auto rotations = rotation_.pull_back<kRows>(body.theta, body.omega);
    ControlRows<kRows> J;
    for (int j = 0; j < order_; ++j) {
      const auto i = static_cast<std::size_t>(j);
      J[i].template leftCols<3>() = weights_.plain[0][j] * body.position + weights_.plain[1][j] * body.velocity +
                                    weights_.plain[2][j] * body.acceleration;
      J[i].template rightCols<3>() = rotations[i];
    }
    return J;
  }

 private:
  double interval_s_;
  int order_;
  int segment_;
  std::array<Eigen::Vector3d, kMostControls> positions_;
  core::RotationSpline rotation_;
  core::bspline::Weights weights_;
  Eigen::Vector3d acceleration_;
};

}  // namespace plumbline::estimator
