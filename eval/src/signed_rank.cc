#include "eval/signed_rank.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numbers>
#include <stdexcept>

#include <boost/math/distributions/normal.hpp>
#include <boost/math/distributions/students_t.hpp>

namespace plumbline::eval {
namespace {

constexpr int kSmallestForInterval = 6;

struct RankedSigns {
  std::vector<int> doubled_ranks;  // 2 rank of |d|, so that shared ranks are whole
  int doubled_positive = 0;        // 2 T+
  double ties = 0.0;               // sum of t^3 - t over groups of t equal |d|
};

RankedSigns rank(std::vector<double> d) {
  std::erase(d, 0.0);
  std::sort(d.begin(), d.end(), [](double a, double b) { return std::abs(a) < std::abs(b); });
  RankedSigns result;
  for (std::size_t begin = 0; begin < d.size();) {
    std::size_t end = begin + 1;
    while (end < d.size() && std::abs(d[end]) == std::abs(d[begin])) ++end;
    const auto doubled = static_cast<int>(begin + 1 + end);  // twice the mean of begin + 1 ... end
    for (std::size_t i = begin; i < end; ++i) {
      result.doubled_ranks.push_back(doubled);
      if (d[i] > 0.0) result.doubled_positive += doubled;
    }
    const auto t = static_cast<double>(end - begin);
    result.ties += t * t * t - t;
    begin = end;
  }
  return result;
}

// P(2 T+ = s) for s = 0, 1, ... under random signs.
std::vector<double> null_distribution(const std::vector<int>& doubled_ranks) {
  std::vector<double> p = {1.0};
  for (const int r : doubled_ranks) {
    const std::size_t size = p.size();
    p.resize(size + static_cast<std::size_t>(r), 0.0);
    for (std::size_t s = p.size(); s-- > 0;) {
      const double with = s >= static_cast<std::size_t>(r) ? p[s - static_cast<std::size_t>(r)] : 0.0;
      p[s] = 0.5 * ((s < size ? p[s] : 0.0) + with);
    }
  }
  return p;
}

double exact_p_value(const RankedSigns& signs) {
  const std::vector<double> p = null_distribution(signs.doubled_ranks);
  const auto observed = static_cast<std::size_t>(signs.doubled_positive);
  const std::size_t smaller = std::min(observed, p.size() - 1 - observed);
  double tail = 0.0;
  for (std::size_t s = 0; s <= smaller; ++s) tail += p[s];
  return std::min(1.0, 2.0 * tail);
}

double normal_p_value(const RankedSigns& signs) {
  const auto n = static_cast<double>(signs.doubled_ranks.size());
  const double mean = n * (n + 1.0) / 4.0;
  const double variance = n * (n + 1.0) * (2.0 * n + 1.0) / 24.0 - signs.ties / 48.0;
  const double off = std::max(0.0, std::abs(0.5 * signs.doubled_positive - mean) - 0.5);
  return std::min(1.0, std::erfc(off / std::sqrt(2.0 * variance)));
}

// How many Walsh averages of the sorted d are at most w.
std::int64_t walsh_averages_up_to(const std::vector<double>& d, double w) {
  std::int64_t count = 0;
  auto j = static_cast<std::ptrdiff_t>(d.size()) - 1;
  for (std::ptrdiff_t i = 0; i < std::ssize(d); ++i) {
    while (j >= i && 0.5 * (d[static_cast<std::size_t>(i)] + d[static_cast<std::size_t>(j)]) > w) --j;
    if (j < i) break;
    count += j - i + 1;
  }
  return count;
}

// The k-th smallest of them (k from 1), without making all n (n + 1) / 2: bisection between the extremes until no
// double lies between.
double walsh_average(const std::vector<double>& d, std::int64_t k) {
  double lo = d.front();
  double hi = d.back();
  if (walsh_averages_up_to(d, lo) >= k) return lo;
  for (;;) {  // up_to(lo) < k <= up_to(hi)
    const double middle = lo + 0.5 * (hi - lo);
    if (middle <= lo || middle >= hi) return hi;
    (walsh_averages_up_to(d, middle) >= k ? hi : lo) = middle;
  }
}

std::vector<double> sorted(std::vector<double> d) {
  if (d.empty()) throw std::invalid_argument("signed rank: no differences");
  if (!std::all_of(d.begin(), d.end(), [](double x) { return std::isfinite(x); })) {
    throw std::invalid_argument("signed rank: differences must be finite");
  }
  std::sort(d.begin(), d.end());
  return d;
}

std::int64_t number_of_averages(const std::vector<double>& d) { return std::ssize(d) * (std::ssize(d) + 1) / 2; }

// The largest c with P(T+ <= c) <= tail for n continuous differences; -1 where there is none.
std::int64_t critical_rank_sum(int n, double tail) {
  if (n > kExactPairs) {
    const double mean = n * (n + 1.0) / 4.0;
    const double sigma = std::sqrt(n * (n + 1.0) * (2.0 * n + 1.0) / 24.0);
    return static_cast<std::int64_t>(
        std::floor(mean + sigma * boost::math::quantile(boost::math::normal(), tail) - 0.5));
  }
  std::vector<int> doubled;
  for (int r = 1; r <= n; ++r) doubled.push_back(2 * r);
  const std::vector<double> p = null_distribution(doubled);
  double sum = 0.0;
  std::int64_t c = -1;
  for (std::size_t s = 0; s < p.size(); s += 2) {
    sum += p[s];
    if (sum > tail) break;
    c = static_cast<std::int64_t>(s / 2);
  }
  return c;
}

}  // namespace

double signed_rank_p_value(const std::vector<double>& differences) {
  const RankedSigns signs = rank(differences);
  if (signs.doubled_ranks.empty()) return 1.0;
  return std::ssize(signs.doubled_ranks) <= kExactPairs ? exact_p_value(signs) : normal_p_value(signs);
}

double hodges_lehmann(const std::vector<double>& differences) {
  const std::vector<double> d = sorted(differences);
  const std::int64_t n = number_of_averages(d);
  const double upper = walsh_average(d, n / 2 + 1);
  return n % 2 == 1 ? upper : 0.5 * (walsh_average(d, n / 2) + upper);
}

std::optional<Interval> hodges_lehmann_interval(const std::vector<double>& differences, double confidence) {
  const bool is_probability = confidence > 0.0 && confidence < 1.0;
  if (!is_probability) throw std::invalid_argument("signed rank: 0 < confidence < 1");
  const std::vector<double> d = sorted(differences);
  const std::int64_t c = critical_rank_sum(static_cast<int>(d.size()), 0.5 * (1.0 - confidence));
  if (c < 0) return std::nullopt;
  return Interval{walsh_average(d, c + 1), walsh_average(d, number_of_averages(d) - c)};
}

std::optional<double> smallest_detectable_shift(double sigma, int n, double alpha, double power) {
  if (n < kSmallestForInterval) return std::nullopt;
  const boost::math::students_t t(n - 1.0);
  const double sum = boost::math::quantile(boost::math::complement(t, 0.5 * alpha)) + boost::math::quantile(t, power);
  return sum * sigma * std::sqrt(std::numbers::pi / (3.0 * n));
}

}  // namespace plumbline::eval
