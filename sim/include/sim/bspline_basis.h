// Basis of a uniform quintic B-spline, u in [0, 1] within a segment:
//   B(u) = M (1, u, ..., u^5),   lambda_j = sum_{s >= j} B_s (cumulative)
// Sommer, Usenko, Schubert, Demmel, Cremers, "Efficient derivative computation for cumulative B-splines on Lie groups",
// CVPR 2020, eq. 5.
#pragma once

#include <Eigen/Core>

namespace plumbline::sim::bspline {

inline constexpr int kOrder = 6;  // degree + 1
using Basis = Eigen::Matrix<double, kOrder, 1>;
using Blending = Eigen::Matrix<double, kOrder, kOrder>;

const Blending& blending();
const Blending& cumulative_blending();

// (1, u, ..., u^5) differentiated `derivative` times.
Basis powers(double u, int derivative);

}  // namespace plumbline::sim::bspline
