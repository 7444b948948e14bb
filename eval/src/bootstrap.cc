#include "eval/bootstrap.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

#include <boost/math/distributions/normal.hpp>

#include "core/random.h"

namespace plumbline::eval {
namespace {

using Statistic = std::function<double(const std::vector<double>&)>;

std::vector<double> resampled(const std::vector<double>& values, const Statistic& statistic, std::uint64_t seed) {
  const core::RandomStream stream({seed, 0}, "bootstrap");
  const auto n = static_cast<double>(values.size());
  std::vector<double> sample(values.size());
  std::vector<double> statistics;
  statistics.reserve(kResamples);
  for (int b = 0; b < kResamples; ++b) {
    for (std::size_t i = 0; i < values.size(); i += 4) {
      const std::array<double, 4> u = stream.uniforms(i / 4, static_cast<std::uint64_t>(b));
      for (std::size_t k = i; k < std::min(i + 4, values.size()); ++k) {
        sample[k] = values[std::min(static_cast<std::size_t>(u[k - i] * n), values.size() - 1)];
      }
    }
    statistics.push_back(statistic(sample));
  }
  std::sort(statistics.begin(), statistics.end());
  return statistics;
}

// sum (mean - s_i)^3 / (6 (sum (mean - s_i)^2)^1.5), s_i the statistic without value i.
double acceleration(const std::vector<double>& values, const Statistic& statistic) {
  std::vector<double> left(values.begin() + 1, values.end());
  std::vector<double> without;
  without.reserve(values.size());
  for (std::size_t i = 0; i < values.size(); ++i) {
    without.push_back(statistic(left));
    if (i < left.size()) left[i] = values[i];
  }
  const double m = mean(without);
  double squares = 0.0;
  double cubes = 0.0;
  for (const double s : without) {
    squares += std::pow(m - s, 2);
    cubes += std::pow(m - s, 3);
  }
  return squares > 0.0 ? cubes / (6.0 * std::pow(squares, 1.5)) : 0.0;
}

}  // namespace

Interval bca_interval(const std::vector<double>& values, const Statistic& statistic, double confidence,
                      std::uint64_t seed) {
  if (std::ssize(values) < kBootstrapTrials) throw std::invalid_argument("bca_interval: at least 200 values");
  const bool is_probability = confidence > 0.0 && confidence < 1.0;
  if (!is_probability) throw std::invalid_argument("bca_interval: 0 < confidence < 1");
  const double observed = statistic(values);
  const std::vector<double> statistics = resampled(values, statistic, seed);
  if (statistics.front() == statistics.back()) return {observed, observed};

  const boost::math::normal normal;
  const auto below = std::lower_bound(statistics.begin(), statistics.end(), observed) - statistics.begin();
  // Half a resample from 0 and 1, so that z0 stays finite.
  const double share = std::clamp(static_cast<double>(below) / kResamples, 0.5 / kResamples, 1.0 - 0.5 / kResamples);
  const double z0 = boost::math::quantile(normal, share);
  const double a = acceleration(values, statistic);
  const auto end = [&](double z) {
    const double level = boost::math::cdf(normal, z0 + (z0 + z) / (1.0 - a * (z0 + z)));
    return quantile(statistics, level);
  };
  const double z = boost::math::quantile(boost::math::complement(normal, 0.5 * (1.0 - confidence)));
  return {end(-z), end(z)};
}

}  // namespace plumbline::eval
