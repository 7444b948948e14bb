// Basis of a uniform B-spline of order k (degree k - 1) within a segment, u in [0, 1]:
//   B(u) = M (1, u, ..., u^(k-1)),   lambda_j = sum_{s >= j} B_s (cumulative)
// Sommer, Usenko, Schubert, Demmel, Cremers, "Efficient derivative computation for cumulative B-splines on Lie groups",
// CVPR 2020, eq. 5.
#pragma once

#include <array>

#include <Eigen/Core>

namespace plumbline::core::bspline {

inline constexpr int kLeastOrder = 2;
inline constexpr int kMostOrder = 6;
using Basis = Eigen::Matrix<double, kMostOrder, 1>;

// The k values of a basis and their first two derivatives with respect to time; what is beyond the order is 0. Outside
// of [0, 1] the segment's polynomials go on.
struct Weights {
  std::array<Basis, 3> plain;
  std::array<Basis, 3> cumulative;
};
Weights weights(int order, double u, double knot_interval_s);

}  // namespace plumbline::core::bspline
