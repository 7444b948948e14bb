#include "eval/statistics.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <stdexcept>

#include <boost/math/distributions/binomial.hpp>
#include <boost/math/distributions/chi_squared.hpp>
#include <boost/math/distributions/students_t.hpp>

namespace plumbline::eval {
namespace {

void require(bool rule, const char* message) {
  if (!rule) throw std::invalid_argument(message);
}

void require_confidence(double confidence) {
  require(confidence > 0.0 && confidence < 1.0, "statistics: 0 < confidence < 1");
}

Interval chi_square_interval(double dof, double confidence) {
  require_confidence(confidence);
  const boost::math::chi_squared distribution(dof);
  const double a = 1.0 - confidence;
  return {boost::math::quantile(distribution, 0.5 * a),
          boost::math::quantile(boost::math::complement(distribution, 0.5 * a))};
}

// t_{n-1} s / sqrt(n): half the width of a t-interval of the mean.
std::optional<double> half_width(const std::vector<double>& values, double confidence) {
  require_confidence(confidence);
  const auto s = sample_std(values);
  if (!s) return std::nullopt;
  const auto n = static_cast<double>(values.size());
  const boost::math::students_t distribution(n - 1.0);
  return boost::math::quantile(boost::math::complement(distribution, 0.5 * (1.0 - confidence))) * *s / std::sqrt(n);
}

}  // namespace

double mean(const std::vector<double>& values) {
  require(!values.empty(), "statistics: no values");
  double sum = 0.0;
  for (const double x : values) sum += x;
  return sum / static_cast<double>(values.size());
}

double root_mean_square(const std::vector<double>& values) {
  require(!values.empty(), "statistics: no values");
  double sum = 0.0;
  for (const double x : values) sum += x * x;
  return std::sqrt(sum / static_cast<double>(values.size()));
}

double quantile(std::vector<double> values, double p) {
  require(!values.empty(), "statistics: no values");
  require(p >= 0.0 && p <= 1.0, "statistics: 0 <= p <= 1");
  std::sort(values.begin(), values.end());
  const double position = p * static_cast<double>(values.size() - 1);
  const auto below = static_cast<std::size_t>(position);
  const std::size_t above = std::min(below + 1, values.size() - 1);
  return std::lerp(values[below], values[above], position - static_cast<double>(below));
}

double median(const std::vector<double>& values) { return quantile(values, 0.5); }

std::optional<double> sample_std(const std::vector<double>& values) {
  if (values.size() < 2) return std::nullopt;
  const double m = mean(values);
  double sum = 0.0;
  for (const double x : values) sum += (x - m) * (x - m);
  return std::sqrt(sum / static_cast<double>(values.size() - 1));
}

Interval chi_square_mean_band(int dof, int n, double confidence) {
  require(dof > 0 && n > 0, "chi_square_mean_band: dof > 0 and n > 0");
  const Interval sum = chi_square_interval(static_cast<double>(n) * dof, confidence);
  return {sum.lo / n, sum.hi / n};
}

Interval rmse_interval(double rmse, int n, double confidence) {
  require(n > 0, "rmse_interval: n > 0");
  const Interval sum = chi_square_interval(n, confidence);
  return {rmse * std::sqrt(n / sum.hi), rmse * std::sqrt(n / sum.lo)};
}

std::optional<Interval> rms_interval(const std::vector<double>& values, double confidence) {
  std::vector<double> squares;
  squares.reserve(values.size());
  for (const double x : values) squares.push_back(x * x);
  const auto half = half_width(squares, confidence);
  if (!half) return std::nullopt;
  const double m = mean(squares);
  if (m == 0.0) return Interval{0.0, 0.0};
  const double factor = std::exp(0.5 * *half / m);
  return Interval{std::sqrt(m) / factor, std::sqrt(m) * factor};
}

std::optional<Interval> mean_interval(const std::vector<double>& values, double confidence) {
  const auto half = half_width(values, confidence);
  if (!half) return std::nullopt;
  const double m = mean(values);
  return Interval{m - *half, m + *half};
}

std::optional<Interval> quantile_interval(std::vector<double> values, double p, double confidence) {
  require(p > 0.0 && p < 1.0, "quantile_interval: 0 < p < 1");
  require_confidence(confidence);
  const auto n = static_cast<int>(values.size());
  const boost::math::binomial below(n, p);
  const double tail = 0.5 * (1.0 - confidence);
  // x_(l) exceeds the quantile with probability P(below < l), x_(u) falls short of it with P(below >= u).
  int l = 0;
  while (l + 1 <= n && boost::math::cdf(below, l) <= tail) ++l;
  int u = n + 1;
  while (u > 1 && boost::math::cdf(boost::math::complement(below, u - 2)) <= tail) --u;
  if (l < 1 || u > n) return std::nullopt;
  std::sort(values.begin(), values.end());
  return Interval{values[static_cast<std::size_t>(l - 1)], values[static_cast<std::size_t>(u - 1)]};
}

Interval binomial_interval(int successes, int n, double confidence) {
  require(n > 0 && successes >= 0 && successes <= n, "binomial_interval: 0 <= successes <= n, n > 0");
  require_confidence(confidence);
  using Binomial = boost::math::binomial;
  const double half = 0.5 * (1.0 - confidence);
  return {Binomial::find_lower_bound_on_p(n, successes, half), Binomial::find_upper_bound_on_p(n, successes, half)};
}

}  // namespace plumbline::eval
