// A camera with a time offset and a rolling shutter, and the tracks of landmarks through its frames.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "core/measurements.h"
#include "core/random.h"
#include "sim/trajectory.h"

namespace plumbline::sim {

struct Exposure {
  Eigen::Vector2d pixel;
  double t_imu_s = 0.0;  // when its row was exposed, IMU clock
  double depth_m = 0.0;
};

// The rig at one frame: what the exact solve of many landmarks shares.
class FrameView {
 public:
  // t_cam_s: the frame's stamp, camera clock.
  FrameView(const Trajectory& trajectory, const core::PinholeCamera& camera, const core::RigCalibration& calibration,
            double t_cam_s);

  // Where the landmark is seen, and when: the solution of
  //   v = h_v(T_W_C(t_imu(v)), P_W),   t_imu(v) = t_cam + td + (v - rows/2) readout / rows
  // to 1e-12 s in time, by Newton's method with the vertical flow of the middle row. Nothing where the landmark is
  // not in front of the camera at that time.
  std::optional<Exposure> expose(const Eigen::Vector3d& P_W) const;

  // False only for a landmark that is certainly outside the picture or the range of depth: a test by the pose of the
  // middle row with the margin that the motion during the readout asks for.
  bool may_see(const Eigen::Vector3d& P_W, double nearest_m, double farthest_m) const;

 private:
  core::Pose camera_pose_at(double t_imu_s) const;

  const Trajectory& trajectory_;
  const core::PinholeCamera& camera_;
  const core::RigCalibration& calibration_;
  double t_middle_s_;
  core::Pose T_C_W_middle_;
  Eigen::Vector3d v_C_;      // of the camera in the world, in camera axes
  Eigen::Vector3d omega_C_;  // of the camera, in camera axes
  double cos_half_angle_;    // of the cone about the optical axis that holds the picture and the margin
  double reach_m_;           // how far the camera moves during half the readout
  double turn_rad_;          // how far it turns
};

struct CameraRecording {
  std::vector<core::Frame> frames;
  std::map<std::int64_t, int> track_landmark;
};

// Frames stamped at multiples of 1/rate whose every row is exposed within [lead_s, duration_s - lead_s]. A frame
// holds the tracks of the last one that are still visible, then landmarks in their order up to points.per_frame.
// Visibility is decided on noise-free projections, so that the pixel noise is not truncated.
CameraRecording simulate_camera(const Trajectory& trajectory, const std::vector<Eigen::Vector3d>& landmarks,
                                const ScenarioConfig& config, double lead_s, core::TrialId id);

}  // namespace plumbline::sim
