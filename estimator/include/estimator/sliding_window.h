// Online estimate: at each keyframe the state of that moment, from the data up to it, with its covariance.
//
// It starts from the prior and, while td is not known to estimator.window.freeze_td_sigma_s, is a batch estimate of all
// keyframes so far, states timed anew where td moves: what is linearised for good with a td that is 20 ms off is wrong
// by tenths of a pixel. From then on the oldest state leaves with each new one (estimator/window.h).
#pragma once

#include <cstddef>

#include "core/estimate.h"
#include "core/measurements.h"
#include "estimator/config.h"

namespace plumbline::estimator {

// The first estimate is that of the frame `first_frame`, from all keyframes between the prior's instant and it.
core::EstimateLog estimate_in_window(const core::MeasurementLog& log, const EstimatorConfig& config,
                                     std::size_t first_frame = 0);

}  // namespace plumbline::estimator
