// Image velocities as a tracker makes them, from the noisy pixels of a track in two consecutive frames a and b:
//   v_b = (x_b - x_a) / dt,   dt = (t_cam,b - t_cam,a) + (row_b - row_a)/rows readout
// x are undistorted normalised coordinates, and dt is the time between the two *rows*: by the frames' interval alone
// the velocity would be off by the vertical motion over the readout. A track's first observation takes the velocity of
// its second (forward difference), a track of one observation has none. The tracker is part of the rig and knows its
// nominal readout only, the mean of the prior.
#pragma once

#include <vector>

#include "core/camera.h"
#include "core/measurements.h"

namespace plumbline::sim {

void add_finite_difference_velocities(std::vector<core::Frame>& frames, const core::PinholeCamera& camera,
                                      double nominal_readout_s);

}  // namespace plumbline::sim
