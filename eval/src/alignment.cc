#include "eval/alignment.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <fmt/format.h>

namespace plumbline::eval {
namespace {

// A trajectory that moves by less than a nanometre is at rest: what is left of it is rounding.
constexpr double kRestSpread2 = 1e-18;
// Singular values of the correlation below this share of the largest are those of a line.
constexpr double kLineRatio = 1e-12;

constexpr std::array<int, 4> kMinPositions = {0, 2, 3, 3};

struct Moments {
  Eigen::Vector3d mean_truth;
  Eigen::Vector3d mean_estimate;
  Eigen::Matrix3d C;               // mean of (x_truth - mean)(x_estimate - mean)^T
  double estimate_variance = 0.0;  // mean of |x_estimate - mean|^2
};

Moments moments(const std::vector<Eigen::Vector3d>& estimate, const std::vector<Eigen::Vector3d>& truth, int n) {
  Moments m{Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(), Eigen::Matrix3d::Zero(), 0.0};
  for (int k = 0; k < n; ++k) {
    m.mean_truth += truth[k] / n;
    m.mean_estimate += estimate[k] / n;
  }
  for (int k = 0; k < n; ++k) {
    const Eigen::Vector3d centred = estimate[k] - m.mean_estimate;
    m.C += (truth[k] - m.mean_truth) * centred.transpose() / n;
    m.estimate_variance += centred.squaredNorm() / n;
  }
  return m;
}

Eigen::Matrix3d best_yaw(const Eigen::Matrix3d& C) {
  const double s = C(1, 0) - C(0, 1);
  const double c = C(0, 0) + C(1, 1);
  if (std::hypot(s, c) <= kRestSpread2) return Eigen::Matrix3d::Identity();
  return Eigen::AngleAxisd(std::atan2(s, c), Eigen::Vector3d::UnitZ()).toRotationMatrix();
}

}  // namespace

AlignmentResult align(const std::vector<Eigen::Vector3d>& estimate, const std::vector<Eigen::Vector3d>& truth,
                      Alignment alignment, int first_n) {
  if (estimate.size() != truth.size()) throw std::invalid_argument("align: as many estimated as true positions");
  if (first_n < 0) throw std::invalid_argument("align: first_n >= 0");
  AlignmentResult result;
  if (alignment == Alignment::kNone) {
    result.ok = true;
    return result;
  }
  const auto index = static_cast<std::size_t>(alignment);
  const auto size = static_cast<int>(estimate.size());
  const int n = first_n == 0 ? size : std::min(first_n, size);
  if (n < kMinPositions[index]) {
    result.reason = fmt::format("{} alignment needs {} poses, not {}", kAlignmentNames[index], kMinPositions[index], n);
    return result;
  }

  const Moments m = moments(estimate, truth, n);
  if (!m.C.allFinite() || !std::isfinite(m.estimate_variance)) {
    result.reason = "the positions are not finite";
    return result;
  }
  Similarity& S = result.truth_from_estimate;
  if (alignment == Alignment::kPosyaw) {
    S.R = best_yaw(m.C);
  } else {
    const Eigen::JacobiSVD<Eigen::Matrix3d> svd(m.C, Eigen::ComputeFullU | Eigen::ComputeFullV);
    const Eigen::Vector3d& d = svd.singularValues();
    if (d(0) <= kRestSpread2 || d(1) <= kLineRatio * d(0)) {
      result.reason = fmt::format("{} alignment is not determined: {}", kAlignmentNames[index],
                                  d(0) <= kRestSpread2 ? "the positions do not move" : "the positions lie on a line");
      return result;
    }
    // Without this sign the best orthogonal matrix may be a reflection.
    const bool reflects = svd.matrixU().determinant() * svd.matrixV().determinant() < 0.0;
    const Eigen::Vector3d sign(1.0, 1.0, reflects ? -1.0 : 1.0);
    S.R = svd.matrixU() * sign.asDiagonal() * svd.matrixV().transpose();
    if (alignment == Alignment::kSim3) S.s = d.dot(sign) / m.estimate_variance;
  }
  S.t = m.mean_truth - S.s * (S.R * m.mean_estimate);
  result.ok = true;
  return result;
}

}  // namespace plumbline::eval
