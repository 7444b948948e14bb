// Brings a window to the minimum that its honest observations have: wrong matches are given up on the way, and while
// nothing has left, the states are timed anew where td moves.
#pragma once

#include "estimator/window.h"

namespace plumbline::estimator {

struct SettledWindow {
  WindowSolution solution;
  WindowFit fit;
  int outliers = 0;  // observations that were given up
  int iterations = 0;
};

SettledWindow settle(Window& window, const EstimatorConfig& config);

}  // namespace plumbline::estimator
