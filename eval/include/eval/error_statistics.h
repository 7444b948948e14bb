// A list of errors in six figures. The standard deviation is that of the population, so that rmse^2 = mean^2 + std^2.
#pragma once

#include <vector>

#include <nlohmann/json_fwd.hpp>

namespace plumbline::eval {

struct ErrorStatistics {
  double rmse = 0.0;
  double mean = 0.0;
  double median = 0.0;
  double std = 0.0;
  double min = 0.0;
  double max = 0.0;
};

ErrorStatistics error_statistics(const std::vector<double>& errors);  // not empty

// {"rmse", "mean", "median", "std", "min", "max"}
nlohmann::ordered_json to_json(const ErrorStatistics& statistics);

}  // namespace plumbline::eval
