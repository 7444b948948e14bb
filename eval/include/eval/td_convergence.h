// When an online estimate of td has converged: the first instant from which on
//   |td - td_true| <= bound      for the rest of its history.
#pragma once

#include <optional>
#include <vector>

#include "core/estimate.h"

namespace plumbline::eval {

inline constexpr double kTdBoundS = 1e-3;

// Nothing where it never does, as for an empty history. In the IMU clock.
std::optional<core::TimeNs> td_settles_at(const std::vector<core::TimeOffsetEstimate>& history, double true_td_s,
                                          double bound_s);

}  // namespace plumbline::eval
