// The first states from data alone: nothing of the prior's state is used, only what it says of the calibration.
//
// Of the newest pictures, at each keyframe anew until it succeeds:
//   rays      of all rows as of the middle one, the gyroscope's turn between taken out
//   path      up to scale                                       structure_from_motion.h
//   turns     gyroscope's bias, td, the camera's orientation    rotation_alignment.h
//   scale     gravity, velocity, accelerometer's bias           scale_alignment.h
//   refined   all of it by the window's own least squares, with td, readout and extrinsics free as the estimate asks
//             for, and wrong matches given up                   window_settle.h
// It waits where there is too little parallax, where no acceleration tells the scale, and where the refined problem
// does not fit or leaves the scale less certain than is asked for.
#pragma once

#include <cstddef>

#include "core/estimate.h"
#include "core/measurements.h"
#include "estimator/config.h"

namespace plumbline::estimator {

struct FromScratch {
  bool found = false;
  core::EstimateLog log;         // the refined states, or why there are none
  core::InitialPrior prior;      // to begin an estimate from: the state before the first picture, which it knows little
                                 // of, lest what it was made from be used twice, and a place for it to start
  std::size_t newest_frame = 0;  // of the log
};

FromScratch initialise_from_scratch(const core::MeasurementLog& log, const EstimatorConfig& config);

}  // namespace plumbline::estimator
