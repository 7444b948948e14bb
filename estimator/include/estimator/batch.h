// Full maximum a posteriori estimate of all keyframes' states, the landmarks, and the calibration: the reference that
// the Cramer-Rao bound speaks of.
//
// The states live at fixed IMU samples: one at the prior's stamp, and one a keyframe, at the sample nearest to
// t_cam + td. It grows: the first seconds are solved, the next ones are predicted by the IMU and triangulated, and so
// on to the end, where the solution is refined until neither the biases nor td have left what the factors were
// linearised about.
#pragma once

#include "core/estimate.h"
#include "core/measurements.h"
#include "estimator/config.h"

namespace plumbline::estimator {

core::EstimateLog estimate_batch(const core::MeasurementLog& log, const EstimatorConfig& config);

}  // namespace plumbline::estimator
