// A point seen at the row times of a rolling-shutter camera with a time offset, whatever carries the body there.
//
// Both ends of the chain of point_chain.h move: T_j is the observer's body when its predicted row is exposed
// (rolling_view.h), T_i the anchor's when that of its bearing is, each on a path whose times count from its own origin,
//   t_i = offset_i + td + (v - rows/2)/rows * readout
// v the row of the estimated bearing (bearing_inverse_depth), or as measured (fixed_bearing).
//   r = h(q) - h(observed),  h of ray_chart.h
//   dr/dtd = J_W (R_i (omega_i x B) + lambda v_i) + h' M q'_j,   dr/dreadout the same, each end times (v - rows/2)/rows
#pragma once

#include <Eigen/Core>

#include "core/camera.h"
#include "estimator/factors/landmark.h"
#include "estimator/factors/parameter_blocks.h"
#include "estimator/factors/ray_chart.h"
#include "estimator/factors/rolling_view.h"

namespace plumbline::estimator {

struct CameraModel {
  core::PinholeCamera camera = {};
  double pixel_sigma_px = 1.0;
  double gravity_m_s2 = 9.81;
  ResidualType residual = ResidualType::kPinhole;
};

// The extrinsics, td and readout in a factor's blocks.
struct TimedRig {
  explicit TimedRig(double const* const* blocks)
      : extrinsics(unpack_pose(blocks[0])), T_B_C(rigid_motion(extrinsics)), td_s(*blocks[1]), readout_s(*blocks[2]) {}

  core::Pose extrinsics;
  RigidMotion T_B_C;
  double td_s;
  double readout_s;
};

// On the tangent spaces; of the bodies at their times.
struct TimedPointJacobians {
  Matrix23 anchor_position;
  Matrix23 anchor_rotation;
  Matrix23 observer_position;
  Matrix23 observer_rotation;
  Matrix23 extrinsic_position;
  Matrix23 extrinsic_rotation;
  Eigen::Vector2d td;
  Eigen::Vector2d readout;
  Eigen::Matrix2d xy;
  Eigen::Vector2d lambda;
};

template <LandmarkType kLandmark>
class TimedPoint {
 public:
  TimedPoint(const CameraModel& model, const Eigen::Vector2d& observed_pixel)
    requires(kLandmark == LandmarkType::kBearingInverseDepth)
      : TimedPoint(model, observed_pixel, Eigen::Vector3d::UnitZ(), 0.0) {}
  TimedPoint(const CameraModel& model, const Eigen::Vector2d& observed_pixel, const Eigen::Vector2d& anchor_pixel)
    requires(kLandmark == LandmarkType::kFixedBearing)
      : TimedPoint(model, observed_pixel, model.camera.unproject(anchor_pixel), anchor_pixel.y()) {}

  // Leaves both paths at their times. False where the landmark is not in front of the observer, or a path has no pose.
  template <class Path>
  bool see(const TimedRig& rig, const double* landmark, Path& anchor, double anchor_offset_s, Path& observer,
           double observer_offset_s, Eigen::Vector2d& residual, TimedPointJacobians* jacobians) const;

  // Those of extrinsics, td, readout and landmark, where they are wanted.
  static void write_shared(const TimedPointJacobians& J, const TimedRig& rig, double** jacobians);

 private:
  struct Anchor;  // bearing, inverse depth and row, from the landmark's block

  TimedPoint(const CameraModel& model, const Eigen::Vector2d& observed_pixel, const Eigen::Vector3d& fixed_bearing,
             double fixed_row_px)
      : camera_(model.camera),
        chart_(model.residual, model.camera, model.pixel_sigma_px, observed_pixel),
        measured_row_(observed_pixel.y()),
        fixed_bearing_(fixed_bearing),
        fixed_row_px_(fixed_row_px) {}

  bool find_anchor(const double* landmark, Anchor& anchor) const;

  core::PinholeCamera camera_;
  RayChart chart_;
  double measured_row_;
  Eigen::Vector3d fixed_bearing_;  // the anchor's observation where it is taken as exact
  double fixed_row_px_;
};

extern template class TimedPoint<LandmarkType::kBearingInverseDepth>;
extern template class TimedPoint<LandmarkType::kFixedBearing>;

}  // namespace plumbline::estimator
