#include "estimator/window_settle.h"

#include <cmath>

namespace plumbline::estimator {
namespace {

// The states are timed anew when td has moved further than this from the td that placed them.
constexpr double kRetimeS = 5e-3;

bool must_retime(const Window& window, const EstimatorConfig& config) {
  return !window.folded() && !config.state_td_s &&
         std::abs(window.calibration().td_s - window.timing_td_s()) > kRetimeS;
}

}  // namespace

SettledWindow settle(Window& window, const EstimatorConfig& config) {
  SettledWindow settled;
  window.triangulate();
  // Where td and the depths are still to be found, a wrong match would be taken for motion.
  if (!window.folded()) {
    window.solve(true);
    settled.outliers += window.assess(true).outliers;
  }
  constexpr int kMaxRounds = 4;
  for (int round = 0; round < kMaxRounds; ++round) {
    settled.solution = window.solve();
    settled.iterations += settled.solution.result.iterations;
    if (settled.solution.result.status == core::SolveStatus::kDiverged) break;
    if (must_retime(window, config)) {
      window.retime(window.calibration().td_s);
      continue;
    }
    settled.fit = window.assess(round + 1 < kMaxRounds);
    settled.outliers += settled.fit.outliers;
    if (settled.fit.outliers == 0) break;
  }
  return settled;
}

}  // namespace plumbline::estimator
