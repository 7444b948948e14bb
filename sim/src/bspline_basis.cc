#include "sim/bspline_basis.h"

#include <cmath>

namespace plumbline::sim::bspline {
namespace {

double binomial(int n, int k) {
  double b = 1.0;
  for (int i = 1; i <= k; ++i) b = b * (n - k + i) / i;
  return b;
}

Blending blending_matrix() {
  Blending M;
  double factorial = 1.0;
  for (int i = 2; i < kOrder; ++i) factorial *= i;
  for (int s = 0; s < kOrder; ++s) {
    for (int n = 0; n < kOrder; ++n) {
      double sum = 0.0;
      for (int l = s; l < kOrder; ++l) {
        sum += ((l - s) % 2 == 0 ? 1.0 : -1.0) * binomial(kOrder, l - s) * std::pow(kOrder - 1 - l, kOrder - 1 - n);
      }
      M(s, n) = binomial(kOrder - 1, n) / factorial * sum;
    }
  }
  return M;
}

}  // namespace

const Blending& blending() {
  static const Blending M = blending_matrix();
  return M;
}

const Blending& cumulative_blending() {
  static const Blending M = [] {
    Blending C = blending();
    for (int s = kOrder - 2; s >= 0; --s) C.row(s) += C.row(s + 1);
    return C;
  }();
  return M;
}

Basis powers(double u, int derivative) {
  Basis b = Basis::Zero();
  for (int n = derivative; n < kOrder; ++n) {
    double factor = 1.0;
    for (int k = 0; k < derivative; ++k) factor *= n - k;
    b[n] = factor * std::pow(u, n - derivative);
  }
  return b;
}

}  // namespace plumbline::sim::bspline
