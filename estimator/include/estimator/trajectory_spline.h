// The unknowns of camera timing `spline`: a cumulative B-spline of poses (factors/spline_path.h) and biases, linear
// between their own knots, over the samples of the IMU that the recording's keyframes span.
//
// Knots by the motion: with the right spacing a spline of k - 1 and k - 2 coefficients a segment (rate and acceleration
// are a derivative and two of the poses') leaves nothing in the gyro's and accelerometer's channels but white noise.
// Then twice as many knots fit no more than noise: the sum of squares falls by chi^2 with as many degrees of freedom as
// there are coefficients more. The spacing is halved until that holds for all six.
#pragma once

#include <vector>

#include "core/state.h"
#include "core/time.h"
#include "estimator/batch_values.h"

namespace plumbline::estimator {

// The spacing by the motion, and never so narrow that an interval has fewer than three samples.
double knot_interval_by_motion(const BatchInput& input, const BatchValues& values);

// Controls and biases near the states of `values`, knots as far apart as `interval_s` or a little less.
TrajectorySpline start_spline(const BatchInput& input, const BatchValues& values, double interval_s);

}  // namespace plumbline::estimator
