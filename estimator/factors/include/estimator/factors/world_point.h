// The pixel at which a rolling-shutter camera with a time offset sees a point of the world, and its derivatives: the
// observer's half of point_factors.h with the point given in the world.
//   v = h_v(T_W_C(tau(v)), P_W),   tau(v) = offset + td + (v - rows/2)/rows * readout
// with the pose at tau carried from the state by the IMU. Derivatives of the solution by the implicit function theorem,
// as in point_factors.h.
#pragma once

#include <optional>

#include <Eigen/Core>

#include "core/calibration.h"
#include "core/state.h"
#include "estimator/factors/point_factors.h"

namespace plumbline::estimator {

struct WorldPointView {
  Eigen::Vector2d pixel;
  double tau_s = 0.0;  // of the exposure, after the state
};

// d pixel / sigma_px with respect to the tangents of core/state.h and of the extrinsics, td, readout, the camera's
// (fx, fy, cx, cy) and P_W.
struct WorldPointJacobians {
  Eigen::Matrix<double, 2, core::kStateDof> state;
  Eigen::Matrix<double, 2, 6> extrinsics;
  Eigen::Vector2d td;
  Eigen::Vector2d readout;
  Eigen::Matrix<double, 2, kIntrinsicsSize> intrinsics;
  Eigen::Matrix<double, 2, 3> point;
};

// The iteration starts at first_row_px, such as the measured row. Nothing where the point is not in front of the camera
// or the time leaves the range of the local motion.
std::optional<WorldPointView> observe_world_point(const CameraModel& model, const FrameTiming& timing,
                                                  const core::State& state, const core::RigCalibration& calibration,
                                                  const Eigen::Vector3d& P_W, double first_row_px,
                                                  WorldPointJacobians* jacobians = nullptr);

}  // namespace plumbline::estimator
