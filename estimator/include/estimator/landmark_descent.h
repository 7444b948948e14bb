// The second half of a step of variable projection: with all else held, each landmark goes to its own minimum, so that
// a step of all parameters is judged by where it leads the poses. (Ruhe and Wedin, "Algorithms for separable nonlinear
// least squares problems", SIAM Review 1980, algorithm 3.)
#pragma once

#include <vector>

#include "estimator/least_squares.h"

namespace plumbline::estimator {

// Moves the eliminated blocks. Each starts from its present value or from that in `before`, the values of all blocks
// before the step, whichever fits better; a landmark that can be seen from neither stays where it is.
void settle_landmarks(const LeastSquares& problem, const std::vector<double>& before);

}  // namespace plumbline::estimator
