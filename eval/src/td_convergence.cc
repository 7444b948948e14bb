#include "eval/td_convergence.h"

#include <algorithm>
#include <cmath>

namespace plumbline::eval {

std::optional<core::TimeNs> td_settles_at(const std::vector<core::TimeOffsetEstimate>& history, double true_td_s,
                                          double bound_s) {
  const auto outside = [&](const core::TimeOffsetEstimate& h) { return !(std::abs(h.td_s - true_td_s) <= bound_s); };
  // One past the last instant at which the error was too large.
  const auto settled = std::find_if(history.rbegin(), history.rend(), outside).base();
  return settled == history.end() ? std::nullopt : std::optional(settled->t_ns);
}

}  // namespace plumbline::eval
