#include "sim/ground_truth.h"

#include <algorithm>

#include <fmt/format.h>

#include "core/error.h"

namespace plumbline::sim {

core::State state_at(const GroundTruth& truth, core::TimeNs t_ns) {
  const auto& states = truth.states;
  const auto after = std::lower_bound(states.begin(), states.end(), t_ns,
                                      [](const core::StampedState& s, core::TimeNs t) { return s.t_ns < t; });
  if (after != states.end() && after->t_ns == t_ns) return after->state;
  if (after == states.end() || after == states.begin()) {
    throw core::DataError(fmt::format("no truth at {} ns: it spans [{}, {}] ns", t_ns,
                                      states.empty() ? 0 : states.front().t_ns,
                                      states.empty() ? 0 : states.back().t_ns));
  }
  const core::StampedState& a = *(after - 1);
  const core::StampedState& b = *after;
  const double s = core::to_seconds(t_ns - a.t_ns) / core::to_seconds(b.t_ns - a.t_ns);
  const auto linear = [s](const Eigen::Vector3d& x, const Eigen::Vector3d& y) -> Eigen::Vector3d {
    return (1.0 - s) * x + s * y;
  };
  return {.T_W_B = {a.state.T_W_B.q.slerp(s, b.state.T_W_B.q), linear(a.state.T_W_B.p, b.state.T_W_B.p)},
          .v_W = linear(a.state.v_W, b.state.v_W),
          .bias = {linear(a.state.bias.gyro_rad_s, b.state.bias.gyro_rad_s),
                   linear(a.state.bias.accel_m_s2, b.state.bias.accel_m_s2)}};
}

}  // namespace plumbline::sim
