// Bias-corrected and accelerated bootstrap interval (BCa) of a statistic s of n independent values; Efron, "Better
// bootstrap confidence intervals", JASA 1987. With s*_b of B resamples, z0 = Phi^-1(share of s*_b < s) and the
// acceleration a from the jackknife,
//   level(z) = Phi( z0 + (z0 + z) / (1 - a (z0 + z)) ),   interval = quantiles of s* at level(-+ z_{1-alpha/2}).
// Only for n >= kBootstrapTrials: below that it is too narrow for errors like ours, while the intervals of
// eval/statistics.h are exact or checked there.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "eval/statistics.h"

namespace plumbline::eval {

inline constexpr int kBootstrapTrials = 200;
inline constexpr int kResamples = 2000;

// A smooth statistic (mean, RMSE; not a median). The resamples follow from `seed` alone. The point itself where all
// values are equal. Throws std::invalid_argument for fewer than kBootstrapTrials values.
Interval bca_interval(const std::vector<double>& values,
                      const std::function<double(const std::vector<double>&)>& statistic, double confidence,
                      std::uint64_t seed = 1);

}  // namespace plumbline::eval
