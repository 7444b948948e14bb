// The location of paired differences d_1 ... d_n that are symmetric about it, without assuming a normal distribution.
//   statistic   T+ = sum of the ranks of |d_i| over the d_i > 0; zeros are left out, equal |d_i| share their mean rank
//   p value     two-sided, of T+ under random signs (Wilcoxon 1945). Exact for up to kExactPairs, ties included, by
//               counting all 2^n signs; above that normal with the variance corrected for ties and a continuity
//               correction of half a rank
//   estimate    median of the n (n + 1) / 2 Walsh averages (d_i + d_j) / 2, i <= j (Hodges & Lehmann 1963), zeros
//               included
//   interval    [W_(k), W_(N+1-k)] of the N ordered Walsh averages, k - 1 the largest whole number that T+ of n
//               continuous differences does not exceed with probability alpha/2: the values the test does not reject
// The interval needs n >= 6 at 95 %: below that not even n equal signs are significant.
#pragma once

#include <optional>
#include <vector>

#include "eval/statistics.h"

namespace plumbline::eval {

inline constexpr int kExactPairs = 50;

// 1 where no difference is other than 0.
double signed_rank_p_value(const std::vector<double>& differences);

// Of at least one finite difference (std::invalid_argument).
double hodges_lehmann(const std::vector<double>& differences);
std::optional<Interval> hodges_lehmann_interval(const std::vector<double>& differences, double confidence);

// The smallest |location| of n normal differences of standard deviation `sigma` that the test at level alpha finds
// with the given power:  (t_{1-alpha/2} + t_{power}) sigma sqrt(pi / (3 n)),  t of n - 1 degrees of freedom, pi/3 the
// price of ranks where the differences are normal. Nothing for n < 6.
std::optional<double> smallest_detectable_shift(double sigma, int n, double alpha, double power);

}  // namespace plumbline::eval
