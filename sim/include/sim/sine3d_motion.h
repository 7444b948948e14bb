// Full three-dimensional motion whose acceleration is constant in the body's axes: R(t)^T d2p/dt2 = (a, 0, 0).
//   yaw = bt, pitch = -ct, roll = 0.4 sin(0.7 bt)                   (b, c: 2 pi over the periods)
//   d2p/dt2 = R (a, 0, 0) = a (cos bt cos ct, sin bt cos ct, sin ct)
//   p = -a (sum_i cos(w_i t) / (2 w_i^2), sum_i sin(w_i t) / (2 w_i^2), sin(ct) / c^2),   w_i = b + c, b - c
#pragma once

#include "sim/harmonic_trajectory.h"

namespace plumbline::sim {

HarmonicTrajectory::Shape sine3d_shape(const Sine3dConfig& config);

}  // namespace plumbline::sim
