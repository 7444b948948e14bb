// The second half of a step of variable projection: with all else held, each landmark goes to its own minimum, so that
// a step of all parameters is judged by where it leads the poses. (Ruhe and Wedin, "Algorithms for separable nonlinear
// least squares problems", SIAM Review 1980, algorithm 3.)
#pragma once

#include <vector>

#include "estimator/least_squares.h"

namespace plumbline::estimator {

// Moves the eliminated blocks, each to within a tenth of a standard deviation. Where a landmark's factors cannot be
// evaluated it starts from what it was in `before`, the values of all blocks before the step, and stays where it is if
// they cannot be evaluated there either.
void settle_landmarks(const LeastSquares& problem, const std::vector<double>& before);

}  // namespace plumbline::estimator
