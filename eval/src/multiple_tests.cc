#include "eval/multiple_tests.h"

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <stdexcept>

#include <boost/math/distributions/binomial.hpp>

namespace plumbline::eval {

double mcnemar_p_value(int only_a, int only_b) {
  if (only_a < 0 || only_b < 0) throw std::invalid_argument("mcnemar_p_value: counts >= 0");
  const int n = only_a + only_b;
  if (n == 0) return 1.0;
  return std::min(1.0, 2.0 * boost::math::cdf(boost::math::binomial(n, 0.5), std::min(only_a, only_b)));
}

std::vector<double> holm(const std::vector<double>& p_values) {
  std::vector<std::size_t> order(p_values.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return p_values[a] < p_values[b]; });
  std::vector<double> adjusted(p_values.size());
  double largest = 0.0;
  for (std::size_t i = 0; i < order.size(); ++i) {
    const auto left = static_cast<double>(order.size() - i);
    largest = std::max(largest, std::min(1.0, left * p_values[order[i]]));
    adjusted[order[i]] = largest;
  }
  return adjusted;
}

}  // namespace plumbline::eval
