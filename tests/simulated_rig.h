// The rig and the motions of the simulated scenes that the factors are tested on (point_scene.h, line_scene.h).
#pragma once

#include <memory>
#include <vector>

#include <Eigen/Geometry>

#include "core/calibration.h"
#include "core/measurements.h"
#include "core/time.h"
#include "rig_blocks.h"
#include "sim/trajectory.h"

namespace plumbline::testing {

inline core::RigCalibration scene_rig(double readout_s, double td_s = 0.013) {
  return {.T_B_C = {core::exp_quaternion(Eigen::Vector3d(0.02, -0.03, 0.01)) * Eigen::Quaterniond(0.5, -0.5, 0.5, -0.5),
                    {0.06, 0.02, -0.01}},
          .td_s = td_s,
          .readout_s = readout_s};
}

// Behind lenses such as those of EuRoC (radtan) and TUM VI (equidistant).
inline core::PinholeCamera scene_camera(core::DistortionModel lens) {
  core::PinholeCamera camera;
  if (lens == core::DistortionModel::kRadtan) camera.distortion = {lens, {-0.283, 0.074, 2e-4, 2e-5}};
  if (lens == core::DistortionModel::kEquidistant) camera.distortion = {lens, {0.0035, 0.0007, -0.0021, 0.0002}};
  return camera;
}

// A camera that slides sideways at constant velocity (none: at rest): the image velocity of each point is constant,
// which is what the timing model `feature_velocity` assumes.
class SlidingMotion final : public sim::Trajectory {
 public:
  SlidingMotion(const core::Pose& T_B_C, const core::Pose& start, const Eigen::Vector2d& velocity_C)
      : start_(start), v_W_(start.q * (T_B_C.q * Eigen::Vector3d(velocity_C.x(), velocity_C.y(), 0.0))) {}

  sim::Kinematics at(double t_s) const override {
    const Eigen::Vector3d zero = Eigen::Vector3d::Zero();
    return {.T_W_B = {start_.q, start_.p + t_s * v_W_}, .v_W = v_W_, .a_W = zero, .omega_B = zero, .alpha_B = zero};
  }

 private:
  core::Pose start_;
  Eigen::Vector3d v_W_;
};

inline core::State state_at(const sim::Trajectory& trajectory, double t_s, const core::ImuBias& bias) {
  const sim::Kinematics x = trajectory.at(t_s);
  return {.T_W_B = x.T_W_B, .v_W = x.v_W, .bias = bias};
}

// The first second of a motion, without noise.
inline std::shared_ptr<const std::vector<core::ImuSample>> exact_samples(const sim::Trajectory& trajectory,
                                                                         double rate_hz, const core::ImuBias& bias) {
  std::vector<core::ImuSample> samples;
  for (int k = 0; k <= static_cast<int>(rate_hz); ++k) {
    const double t_s = k / rate_hz;
    const sim::Kinematics x = trajectory.at(t_s);
    samples.push_back({core::to_ns(t_s), x.omega_B + bias.gyro_rad_s,
                       x.T_W_B.q.conjugate() * (x.a_W + Eigen::Vector3d(0.0, 0.0, kGravity)) + bias.accel_m_s2});
  }
  return std::make_shared<const std::vector<core::ImuSample>>(std::move(samples));
}

}  // namespace plumbline::testing
