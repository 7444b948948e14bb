// Closed curves, travelled with the body's x axis ahead (w = 2 pi / period_s, r = radius_m, h = height_amplitude_m):
//   circle          (r cos wt, r sin wt, h sin 3wt)
//   wavy circle     (r cos wt, r sin wt, h sin nwt),  n waves
//   figure eight    (r sin wt, r/2 sin 2wt, h sin 3wt), the lemniscate of Gerono
//   ball            r (cos bt cos wt, cos bt sin wt, sin bt), b = 0.38 w: over a sphere
//   torus           ((r + q cos 3wt) cos wt, (r + q cos 3wt) sin wt, q sin 3wt), q = tube_radius_m: around its tube
// All nod gently in pitch and roll, so that no axis stays at rest.
#pragma once

#include "sim/harmonic_trajectory.h"

namespace plumbline::sim {

HarmonicTrajectory::Shape circle_shape(const LoopConfig& config);
HarmonicTrajectory::Shape wavy_circle_shape(const LoopConfig& config);
HarmonicTrajectory::Shape figure_eight_shape(const LoopConfig& config);
HarmonicTrajectory::Shape ball_shape(const LoopConfig& config);
HarmonicTrajectory::Shape torus_shape(const LoopConfig& config);

}  // namespace plumbline::sim
