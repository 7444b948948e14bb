#include "sim/loop_motion.h"

#include <numbers>

namespace plumbline::sim {
namespace {

constexpr double kQuarterTurn = 0.5 * std::numbers::pi;

double angular_frequency(const LoopConfig& config) { return 2.0 * std::numbers::pi / config.period_s; }

HarmonicTrajectory::Shape nodding(const LoopConfig& config) {
  const double w = angular_frequency(config);
  HarmonicTrajectory::Shape shape;
  shape.pitch.terms = {{0.1, 2.0 * w, 0.3}};
  shape.roll.terms = {{0.1, 3.0 * w, 1.1}};
  shape.yaw_follows_path = true;
  return shape;
}

HarmonicTrajectory::Shape circle_with_waves(const LoopConfig& config, int waves) {
  const double w = angular_frequency(config);
  HarmonicTrajectory::Shape shape = nodding(config);
  shape.position[0].terms = {{config.radius_m, w, kQuarterTurn}};
  shape.position[1].terms = {{config.radius_m, w, 0.0}};
  shape.position[2].terms = {{config.height_amplitude_m, waves * w, 0.0}};
  return shape;
}

// Adds (c cos bt cos wt, c cos bt sin wt): the products as sums.
void add_modulated_circle(HarmonicTrajectory::Shape& shape, double c, double b, double w) {
  for (const double omega : {w + b, w - b}) {
    shape.position[0].terms.push_back({0.5 * c, omega, kQuarterTurn});
    shape.position[1].terms.push_back({0.5 * c, omega, 0.0});
  }
}

}  // namespace

HarmonicTrajectory::Shape circle_shape(const LoopConfig& config) { return circle_with_waves(config, 3); }

HarmonicTrajectory::Shape wavy_circle_shape(const LoopConfig& config) {
  return circle_with_waves(config, config.waves);
}

HarmonicTrajectory::Shape figure_eight_shape(const LoopConfig& config) {
  const double w = angular_frequency(config);
  HarmonicTrajectory::Shape shape = nodding(config);
  shape.position[0].terms = {{config.radius_m, w, 0.0}};
  shape.position[1].terms = {{0.5 * config.radius_m, 2.0 * w, 0.0}};
  shape.position[2].terms = {{config.height_amplitude_m, 3.0 * w, 0.0}};
  return shape;
}

HarmonicTrajectory::Shape ball_shape(const LoopConfig& config) {
  const double w = angular_frequency(config);
  const double b = 0.38 * w;
  HarmonicTrajectory::Shape shape = nodding(config);
  add_modulated_circle(shape, config.radius_m, b, w);
  shape.position[2].terms = {{config.radius_m, b, 0.0}};
  return shape;
}

HarmonicTrajectory::Shape torus_shape(const LoopConfig& config) {
  const double w = angular_frequency(config);
  HarmonicTrajectory::Shape shape = nodding(config);
  shape.position[0].terms = {{config.radius_m, w, kQuarterTurn}};
  shape.position[1].terms = {{config.radius_m, w, 0.0}};
  add_modulated_circle(shape, config.tube_radius_m, 3.0 * w, w);
  shape.position[2].terms = {{config.tube_radius_m, 3.0 * w, 0.0}};
  return shape;
}

}  // namespace plumbline::sim
