// The Cramer-Rao bound of a trial's metrics (eval/metrics.h): the root of the expected square that no unbiased
// estimator falls below. Of a signed error its standard deviation, of a norm the root of the trace of its covariance,
// of the ATE that of eval/aligned_bound.h. Over trials, efficiency = sqrt( sum e^2 / sum b^2 ), 1 at the bound.
#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include "eval/cramer_rao.h"
#include "eval/metrics.h"
#include "eval/series.h"

namespace plumbline::eval {

// In the metric's unit; nothing for a metric that has no bound (a joint block of several units, a residual) or is of
// something that was held.
std::optional<double> metric_bound(const CramerRaoBound& bound, std::string_view metric);

void add_bounds(const CramerRaoBound& bound, std::vector<Metric>& metrics);

// The causal bounds on the grid of a series; `start` is the stamp of the first estimated state.
std::vector<BoundPoint> bound_series(const CramerRaoBound& bound, core::TimeNs start);

}  // namespace plumbline::eval
