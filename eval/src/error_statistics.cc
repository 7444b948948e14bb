#include "eval/error_statistics.h"

#include <algorithm>
#include <cmath>

#include <nlohmann/json.hpp>

#include "eval/statistics.h"

namespace plumbline::eval {

ErrorStatistics error_statistics(const std::vector<double>& errors) {
  const double m = mean(errors);
  double sum2 = 0.0;
  for (const double e : errors) sum2 += (e - m) * (e - m);
  const auto [min, max] = std::minmax_element(errors.begin(), errors.end());
  return {.rmse = root_mean_square(errors),
          .mean = m,
          .median = median(errors),
          .std = std::sqrt(sum2 / static_cast<double>(errors.size())),
          .min = *min,
          .max = *max};
}

nlohmann::ordered_json to_json(const ErrorStatistics& s) {
  return {{"rmse", s.rmse}, {"mean", s.mean}, {"median", s.median}, {"std", s.std}, {"min", s.min}, {"max", s.max}};
}

}  // namespace plumbline::eval
