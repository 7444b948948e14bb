// One frame of a camera with a time offset and a rolling shutter: where and when it sees a landmark.
//   v = h_v(T_W_C(t_imu(v)), P_W),   t_imu(v) = t_cam + td + (v - rows/2) readout / rows
#pragma once

#include <optional>

#include <Eigen/Core>

#include "core/calibration.h"
#include "core/camera.h"
#include "sim/trajectory.h"

namespace plumbline::sim {

struct Exposure {
  Eigen::Vector2d pixel;
  double t_imu_s = 0.0;  // when its row was exposed, IMU clock
  double depth_m = 0.0;
  Eigen::Vector3d camera_W;  // where the camera was then
};

// The half angle of a cone about the optical axis that holds the picture.
double half_angle_of_view_rad(const core::PinholeCamera& camera);

// The rig at one frame: what the exact solve of many landmarks shares.
class FrameView {
 public:
  // t_cam_s: when the frame was taken, camera clock. half_angle_rad: that of the camera's view.
  FrameView(const Trajectory& trajectory, const core::PinholeCamera& camera, const core::RigCalibration& calibration,
            double half_angle_rad, double t_cam_s);

  // Where the landmark is seen, and when: the solution of the equation above to 1e-12 s in time, by Newton's method
  // with the vertical flow of the middle row. Nothing where the camera does not see the landmark (behind it, or beyond
  // the fold of its lens) at that time or at the middle row's.
  std::optional<Exposure> expose(const Eigen::Vector3d& P_W) const;

  // The same to first order in the motion during the readout, for a start: a pixel is off by its acceleration times
  // half the square of its row's delay. Nothing where the middle row's pose does not see the landmark.
  std::optional<Exposure> glance(const Eigen::Vector3d& P_W) const;

  // In the camera of the middle row, and how far a point at a distance from it may have moved at its own row, [m].
  Eigen::Vector3d in_middle_row(const Eigen::Vector3d& P_W) const { return T_C_W_middle_ * P_W; }
  double reach_m(double distance_m) const { return reach_m_ + turn_rad_ * distance_m; }

  // False only for a landmark that is certainly outside the picture or the range of depth: a test by the pose of the
  // middle row with the margin that the motion during the readout asks for.
  bool may_see(const Eigen::Vector3d& P_W, double nearest_m, double farthest_m) const;

  // d(x, y)/dt [1/s] of the landmark's normalised coordinates x = X/Z, y = Y/Z in the moving camera, at an instant.
  Eigen::Vector2d image_velocity(const Eigen::Vector3d& P_W, double t_imu_s) const;

 private:
  // The landmark at the middle row's time, and the row that its motion there predicts.
  struct MiddleRow {
    Eigen::Vector3d P_C;
    Eigen::Vector3d P_C_dot;  // m/s
    Eigen::Vector2d pixel;
    Eigen::Vector2d flow;  // px/s
    double slope = 1.0;    // d(row - shown row)/d row
    double row = 0.0;
  };
  std::optional<MiddleRow> at_middle_row(const Eigen::Vector3d& P_W) const;
  core::Pose camera_pose_at(double t_imu_s) const;

  const Trajectory& trajectory_;
  const core::PinholeCamera& camera_;
  core::RigCalibration calibration_;
  double t_middle_s_;
  core::Pose T_C_W_middle_;
  core::Pose T_W_C_middle_;
  Eigen::Vector3d v_C_;      // of the camera in the world, in camera axes
  Eigen::Vector3d omega_C_;  // of the camera, in camera axes
  double cos_half_angle_;    // of the cone about the optical axis that holds the picture and the margin
  double reach_m_;           // how far the camera moves during half the readout
  double turn_rad_;          // how far it turns
};

}  // namespace plumbline::sim
