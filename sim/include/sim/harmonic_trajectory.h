// Trajectories whose coordinates are sums of sinusoids of time, with all derivatives in closed form.
//   p(t) = (x(t), y(t), z(t)),   R(t) = Rz(yaw) Ry(pitch) Rx(roll)
// The yaw is a sum of sinusoids too, or the direction of travel, atan2(dy/dt, dx/dt).
#pragma once

#include <array>
#include <vector>

#include "sim/trajectory.h"

namespace plumbline::sim {

// offset + slope t + sum_i amplitude_i sin(omega_i t + phase_i)
struct SinusoidSum {
  struct Term {
    double amplitude = 0.0;
    double omega_rad_s = 0.0;
    double phase_rad = 0.0;
  };
  double offset = 0.0;
  double slope = 0.0;
  std::vector<Term> terms;

  // The value and its first three derivatives.
  std::array<double, 4> derivatives(double t_s) const;
  double value(double t_s) const;
};

class HarmonicTrajectory final : public Trajectory {
 public:
  struct Shape {
    std::array<SinusoidSum, 3> position;  // x, y, z
    SinusoidSum yaw;                      // unused where the yaw follows the path
    SinusoidSum pitch;
    SinusoidSum roll;
    bool yaw_follows_path = false;  // needs a horizontal velocity that never vanishes
  };

  explicit HarmonicTrajectory(Shape shape) : shape_(std::move(shape)) {}

  Kinematics at(double t_s) const override;
  core::Pose pose_at(double t_s) const override;

 private:
  Shape shape_;
};

// Sums that the user gives.
HarmonicTrajectory::Shape sinusoids_shape(const SinusoidsConfig& config);

}  // namespace plumbline::sim
