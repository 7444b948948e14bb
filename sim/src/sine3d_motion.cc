#include "sim/sine3d_motion.h"

#include <numbers>

namespace plumbline::sim {

HarmonicTrajectory::Shape sine3d_shape(const Sine3dConfig& config) {
  const double a = config.acceleration_m_s2;
  const double b = 2.0 * std::numbers::pi / config.yaw_period_s;
  const double c = 2.0 * std::numbers::pi / config.pitch_period_s;
  HarmonicTrajectory::Shape shape;
  for (const double w : {b + c, b - c}) {
    const double amplitude = -0.5 * a / (w * w);
    shape.position[0].terms.push_back({amplitude, w, 0.5 * std::numbers::pi});
    shape.position[1].terms.push_back({amplitude, w, 0.0});
  }
  shape.position[2].terms = {{-a / (c * c), c, 0.0}};
  shape.yaw.slope = b;
  shape.pitch.slope = -c;
  shape.roll.terms = {{0.4, 0.7 * b, 0.0}};
  return shape;
}

}  // namespace plumbline::sim
