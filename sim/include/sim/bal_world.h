// A bundle problem whose answer is known: cameras on a wavy ring look inwards at points in a ball.
//   camera k   at angle 2 pi k/n, radius ring_radius_m (10 % wave in radius and height), looking at a random place
//              near the centre, its own f, k1, k2
//   point i    uniform in the ball of ball_radius_m about the centre
// A camera sees a point where its noise-free projection lies within half_picture_px of the centre in u and v; points
// that fewer than two cameras see are left out. The problem has pixel noise and starts from cameras and points moved
// by Gaussian errors.
#pragma once

#include "core/bal_file.h"
#include "core/random.h"

namespace plumbline::sim {

struct BalWorldConfig {
  int cameras = 20;
  int points = 1000;
  double ring_radius_m = 6.0;
  double ball_radius_m = 2.5;
  double f_px = 800.0;
  double half_picture_px = 480.0;
  double pixel_sigma_px = 0.5;
  // Of the start, an axis.
  double start_rotation_sigma_rad = 0.01;
  double start_position_sigma_m = 0.05;
  double start_point_sigma_m = 0.05;
  double start_focal_sigma = 0.02;  // relative
};

struct BalSimulation {
  core::BalProblem truth;    // with the noise-free observations
  core::BalProblem problem;  // what an adjustment is given
};

BalSimulation simulate_bal(const BalWorldConfig& config, core::TrialId id);

}  // namespace plumbline::sim
