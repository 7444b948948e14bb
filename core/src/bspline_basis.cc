#include "core/bspline_basis.h"

#include <cmath>

namespace plumbline::core::bspline {
namespace {

using Blending = Eigen::Matrix<double, kMostOrder, kMostOrder>;

double binomial(int n, int k) {
  double b = 1.0;
  for (int i = 1; i <= k; ++i) b = b * (n - k + i) / i;
  return b;
}

Blending blending_matrix(int order) {
  Blending M = Blending::Zero();
  double factorial = 1.0;
  for (int i = 2; i < order; ++i) factorial *= i;
  for (int s = 0; s < order; ++s) {
    for (int n = 0; n < order; ++n) {
      double sum = 0.0;
      for (int l = s; l < order; ++l) {
        sum += ((l - s) % 2 == 0 ? 1.0 : -1.0) * binomial(order, l - s) * std::pow(order - 1 - l, order - 1 - n);
      }
      M(s, n) = binomial(order - 1, n) / factorial * sum;
    }
  }
  return M;
}

struct BlendingPair {
  Blending plain;
  Blending cumulative;
};

const BlendingPair& blending(int order) {
  static const auto matrices = [] {
    std::array<BlendingPair, kMostOrder + 1> result;
    for (int k = kLeastOrder; k <= kMostOrder; ++k) {
      BlendingPair& pair = result[static_cast<std::size_t>(k)];
      pair.plain = pair.cumulative = blending_matrix(k);
      for (int s = k - 2; s >= 0; --s) pair.cumulative.row(s) += pair.cumulative.row(s + 1);
    }
    return result;
  }();
  return matrices.at(static_cast<std::size_t>(order));
}

}  // namespace

Weights weights(int order, double u, double knot_interval_s) {
  const BlendingPair& M = blending(order);
  std::array<Basis, 3> powers = {Basis::Zero(), Basis::Zero(), Basis::Zero()};
  const double rate = 1.0 / knot_interval_s;
  double power = 1.0;
  for (int n = 0; n < order; ++n) {
    powers[0][n] = power;
    if (n + 1 < order) powers[1][n + 1] = (n + 1) * power * rate;
    if (n + 2 < order) powers[2][n + 2] = (n + 2) * (n + 1) * power * rate * rate;
    power *= u;
  }
  Weights w;
  for (std::size_t d = 0; d < 3; ++d) {
    w.plain[d].noalias() = M.plain * powers[d];
    w.cumulative[d].noalias() = M.cumulative * powers[d];
  }
  return w;
}

}  // namespace plumbline::core::bspline
