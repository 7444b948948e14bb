#include "core/distortion.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <span>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>

namespace plumbline::core {
namespace {

// The equidistant lens' widest ray: a camera sees nothing nearer than this to its own plane (core/camera.h).
constexpr double kWidestRad = 0.5 * std::numbers::pi - 1e-6;

// The smallest positive root of 1 + a[0] s + a[1] s^2 + ...; infinity if there is none. With t = 1/s it is the largest
// of the monic polynomial t^n + a[0] t^(n-1) + ..., an eigenvalue of its companion matrix.
double smallest_positive_root(std::span<const double> a) {
  while (!a.empty() && a.back() == 0.0) a = a.first(a.size() - 1);
  const auto n = static_cast<Eigen::Index>(a.size());
  if (n == 0) return std::numeric_limits<double>::infinity();
  Eigen::MatrixXd companion = Eigen::MatrixXd::Zero(n, n);
  for (Eigen::Index i = 0; i < n; ++i) companion(0, i) = -a[static_cast<std::size_t>(i)];
  companion.diagonal(-1).setOnes();
  double largest = 0.0;
  const Eigen::EigenSolver<Eigen::MatrixXd> solver(companion, false);
  for (const std::complex<double>& t : solver.eigenvalues()) {
    if (t.imag() == 0.0) largest = std::max(largest, t.real());
  }
  return 1.0 / largest;
}

}  // namespace

Distortion::Distortion(DistortionModel model, const std::array<double, 4>& coefficients)
    : model_(model), k_(coefficients) {
  switch (model_) {
    case DistortionModel::kNone:
      break;
    case DistortionModel::kRadtan:
      fold_ = std::sqrt(smallest_positive_root(std::array{3.0 * k_[0], 5.0 * k_[1]}));
      break;
    case DistortionModel::kEquidistant:
      fold_ =
          std::min(kWidestRad,
                   std::sqrt(smallest_positive_root(std::array{3.0 * k_[0], 5.0 * k_[1], 7.0 * k_[2], 9.0 * k_[3]})));
      break;
  }
}

Distortion::Radial Distortion::radial(double x) const {
  const double s = x * x;
  if (model_ == DistortionModel::kRadtan) {
    return {x * (1.0 + s * (k_[0] + s * k_[1])), 1.0 + s * (3.0 * k_[0] + s * 5.0 * k_[1])};
  }
  return {x * (1.0 + s * (k_[0] + s * (k_[1] + s * (k_[2] + s * k_[3])))),
          1.0 + s * (3.0 * k_[0] + s * (5.0 * k_[1] + s * (7.0 * k_[2] + s * 9.0 * k_[3])))};
}

std::optional<Eigen::Vector2d> Distortion::apply(const Eigen::Vector2d& xy, Eigen::Matrix2d* J) const {
  const double r2 = xy.squaredNorm();
  double scale = 1.0;          // d, or theta_d/r
  double scale_dr_by_r = 0.0;  // its derivative by r, divided by r
  switch (model_) {
    case DistortionModel::kNone:
      if (J != nullptr) J->setIdentity();
      return xy;
    case DistortionModel::kRadtan:
      if (!(r2 < fold_ * fold_)) return std::nullopt;
      scale = 1.0 + r2 * (k_[0] + r2 * k_[1]);
      scale_dr_by_r = 2.0 * k_[0] + 4.0 * k_[1] * r2;
      break;
    case DistortionModel::kEquidistant: {
      const double r = std::sqrt(r2);
      const double theta = std::atan(r);
      if (!(theta < fold_)) return std::nullopt;
      // Below 1e-4 two terms of the series are exact to rounding, and the quotients are not.
      if (r < 1e-4) {
        scale = 1.0 + r2 * (k_[0] - 1.0 / 3.0);
        scale_dr_by_r = 2.0 * (k_[0] - 1.0 / 3.0);
      } else {
        const auto [theta_d, slope] = radial(theta);
        scale = theta_d / r;
        scale_dr_by_r = (slope / (1.0 + r2) - scale) / r2;
      }
      break;
    }
  }
  Eigen::Vector2d xy_d = scale * xy;
  Eigen::Matrix2d D = scale * Eigen::Matrix2d::Identity() + scale_dr_by_r * (xy * xy.transpose());
  if (model_ == DistortionModel::kRadtan) {
    const double x = xy.x();
    const double y = xy.y();
    const double p1 = k_[2];
    const double p2 = k_[3];
    xy_d += Eigen::Vector2d(2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x), p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y);
    const double mixed = 2.0 * (p1 * x + p2 * y);
    D(0, 0) += 2.0 * p1 * y + 6.0 * p2 * x;
    D(0, 1) += mixed;
    D(1, 0) += mixed;
    D(1, 1) += 6.0 * p1 * y + 2.0 * p2 * x;
    // The tangential part shifts the fold.
    if (!(D.determinant() > 0.0)) return std::nullopt;
  }
  if (J != nullptr) *J = D;
  return xy_d;
}

// Newton's method kept inside an interval that holds the root, by bisection where it would leave it.
std::optional<double> Distortion::invert_radial(double distorted) const {
  double low = 0.0;
  double high = fold_;
  if (!std::isfinite(high)) {
    high = std::max(1.0, distorted);
    while (radial(high).value < distorted) high *= 2.0;
  } else if (!(distorted < radial(high).value)) {
    return std::nullopt;
  }
  constexpr int kMaxIterations = 100;
  double x = std::min(distorted, 0.5 * (low + high));
  for (int i = 0; i < kMaxIterations; ++i) {
    const auto [value, slope] = radial(x);
    (value < distorted ? low : high) = x;
    double next = x + (distorted - value) / slope;
    if (!(next > low && next < high)) next = 0.5 * (low + high);
    const double step = std::abs(next - x);
    x = next;
    if (step <= 1e-15 * (1.0 + x)) break;
  }
  return x;
}

std::optional<Eigen::Vector2d> Distortion::remove(const Eigen::Vector2d& xy_d) const {
  switch (model_) {
    case DistortionModel::kNone:
      return xy_d;
    case DistortionModel::kRadtan:
      return remove_radtan(xy_d);
    case DistortionModel::kEquidistant: {
      const double theta_d = xy_d.norm();
      const auto theta = invert_radial(theta_d);
      if (!theta) return std::nullopt;
      return theta_d < 1e-8 ? xy_d : Eigen::Vector2d(xy_d * (std::tan(*theta) / theta_d));
    }
  }
  return std::nullopt;
}

// From the inverse without the tangential part, by Newton's method that shortens a step which would cross the fold.
std::optional<Eigen::Vector2d> Distortion::remove_radtan(const Eigen::Vector2d& xy_d) const {
  const double r_d = xy_d.norm();
  if (r_d == 0.0) return xy_d;
  const double r = invert_radial(r_d).value_or(0.99 * fold_);
  Eigen::Vector2d xy = xy_d * (r / r_d);
  Eigen::Matrix2d J;
  auto seen = apply(xy, &J);
  for (int i = 0; !seen && i < 10; ++i) {
    xy *= 0.9;
    seen = apply(xy, &J);
  }
  if (!seen) return std::nullopt;
  constexpr int kMaxIterations = 50;
  const double rounding = 1e-15 * (1.0 + r_d);
  for (int i = 0; i < kMaxIterations && (xy_d - *seen).norm() > rounding; ++i) {
    Eigen::Vector2d step = J.inverse() * (xy_d - *seen);
    Eigen::Matrix2d next_J;
    auto next = apply(xy + step, &next_J);
    for (int half = 0; !next && half < 30; ++half) {
      step *= 0.5;
      next = apply(xy + step, &next_J);
    }
    if (!next) return std::nullopt;
    xy += step;
    seen = next;
    J = next_J;
  }
  // The last steps may go to and fro by some units of rounding.
  if ((xy_d - *seen).norm() > 100.0 * rounding) return std::nullopt;
  return xy;
}

}  // namespace plumbline::core
