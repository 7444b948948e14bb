// The motion of the body. Every trajectory gives pose and its derivatives in closed form at any time, so that the IMU
// and the camera of a simulation are exactly consistent.
#pragma once

#include <memory>
#include <optional>

#include <Eigen/Core>

#include "core/lie.h"
#include "core/pose_formats.h"
#include "core/random.h"
#include "sim/scenario.h"

namespace plumbline::sim {

struct Kinematics {
  core::Pose T_W_B;
  Eigen::Vector3d v_W;      // dp/dt, m/s
  Eigen::Vector3d a_W;      // d2p/dt2, m/s^2 (gravity not included)
  Eigen::Vector3d omega_B;  // dR/dt = R [omega_B]x, rad/s
  Eigen::Vector3d alpha_B;  // d omega_B/dt, rad/s^2
};

class Trajectory {
 public:
  virtual ~Trajectory() = default;

  // t_s counts from the start of the recording, in the IMU clock; within [0, duration of the scenario].
  virtual Kinematics at(double t_s) const = 0;
  virtual core::Pose pose_at(double t_s) const { return at(t_s).T_W_B; }
};

// Throws core::DataError where a pose file cannot be read, core::RuleError where it does not hold what is asked of it.
std::unique_ptr<const Trajectory> make_trajectory(const TrajectoryConfig& config, double duration_s, core::TrialId id);

// How far the poses of a spline's file lie from it, over the span of the recording.
struct FitResiduals {
  double position_rms_m = 0.0;
  double rotation_rms_rad = 0.0;
};

// What became of a pose file; nothing for other trajectories.
struct SplineReport {
  core::PoseFormat format = core::PoseFormat::kTum;
  double from_s = 0.0;  // the part of the file that the spline is of, after its first pose
  double to_s = 0.0;
  FitResiduals residuals;
};
std::optional<SplineReport> spline_report(const TrajectoryConfig& config, double duration_s);

// How strongly a trajectory moves, over a grid of 100 Hz: what makes td observable, and what tells a fit that follows
// the noise of its poses.
struct MotionStrength {
  double path_m = 0.0;
  double speed_rms_m_s = 0.0;
  double acceleration_rms_m_s2 = 0.0;
  double rate_rms_rad_s = 0.0;
  double rate_peak_rad_s = 0.0;
  double angular_acceleration_rms_rad_s2 = 0.0;
};
MotionStrength motion_strength(const Trajectory& trajectory, double duration_s);

}  // namespace plumbline::sim
