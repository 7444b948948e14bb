// Image velocities of the ends of a segment as a tracker makes them, from its noisy chords in two consecutive frames a
// and b. Where along the line an end lies is no measurement (the aperture problem), so only what is across the line is
// told: the way from the foot of the perpendicular on the other chord's line,
//   v_b,k = (x_b,k - foot_a) / dt,   dt = (t_cam,b - t_cam,a) + (row of x_b,k - row of foot_a)/rows readout
// in undistorted normalised coordinates, with the time between the two *rows* at the nominal readout, as for points
// (sim/track_velocity.h). A track's first observation takes the forward difference, (foot_b - x_a,k) / dt.
#pragma once

#include <vector>

#include "core/camera.h"
#include "core/measurements.h"

namespace plumbline::sim {

void add_finite_difference_line_velocities(std::vector<core::Frame>& frames, const core::PinholeCamera& camera,
                                           double nominal_readout_s);

}  // namespace plumbline::sim
