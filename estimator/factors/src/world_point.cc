#include "estimator/factors/world_point.h"

#include <cmath>

namespace plumbline::estimator {

std::optional<WorldPointView> observe_world_point(const CameraModel& model, const FrameTiming& timing,
                                                  const core::State& state, const core::RigCalibration& calibration,
                                                  const Eigen::Vector3d& P_W, double first_row_px,
                                                  WorldPointJacobians* jacobians) {
  const int rows = model.camera.height_px;
  const double s_per_row = calibration.readout_s / rows;
  const Eigen::Matrix3d R_c = calibration.T_B_C.q.toRotationMatrix();
  constexpr int kMaxIterations = 20;
  constexpr double kTolerancePx = 1e-9;
  double row = first_row_px;
  for (int iteration = 0; iteration < kMaxIterations; ++iteration) {
    const double tau_s = timing.offset_s + calibration.td_s + core::row_phase(row, rows) * calibration.readout_s;
    TimedBody body;
    LocalPoseJacobians local;
    if (!body_at(*timing.motion, state, model.gravity_m_s2, tau_s, body, &local)) return std::nullopt;
    const Eigen::Vector3d X = body.R.transpose() * (P_W - body.p);
    const Eigen::Vector3d q = R_c.transpose() * (X - calibration.T_B_C.p);
    Eigen::Matrix<double, 2, 3> G;
    const auto pixel = model.camera.project(q, &G);
    if (!pixel) return std::nullopt;
    const Eigen::Matrix<double, 2, 3> J_X = G * R_c.transpose();
    const Eigen::Vector2d flow = J_X * (X.cross(body.local.omega) - body.R.transpose() * body.velocity);
    const double slope = 1.0 - flow.y() * s_per_row;
    if (slope < 0.1) return std::nullopt;  // the point races the shutter
    const double defect = pixel->y() - row;
    row += defect / slope;
    if (std::abs(defect) > kTolerancePx && calibration.readout_s != 0.0) continue;
    if (jacobians == nullptr) return WorldPointView{*pixel, tau_s};

    Eigen::Matrix2d M = Eigen::Matrix2d::Identity();
    M.col(1) += flow * (s_per_row / slope);
    M /= model.pixel_sigma_px;
    const Eigen::Matrix<double, 2, 3> M_X = M * J_X;
    const Eigen::Matrix<double, 2, 3> M_p = -M_X * body.R.transpose();
    const Eigen::Matrix<double, 2, 3> M_theta = M_X * core::skew(X);
    const Eigen::Matrix<double, 2, 3> M_p_body = M_p * state.T_W_B.q.toRotationMatrix();
    WorldPointJacobians& J = *jacobians;
    J.state.middleCols<3>(core::kPosition) = M_p;
    J.state.middleCols<3>(core::kOrientation) =
        M_theta * body.local.R.transpose() - M_p_body * core::skew(body.local.p);
    J.state.middleCols<3>(core::kVelocity) = tau_s * M_p;
    J.state.middleCols<3>(core::kGyroBias) = M_p_body * local.p_bg + M_theta * local.R_bg;
    J.state.middleCols<3>(core::kAccelBias) = M_p_body * local.p_ba;
    J.extrinsics.leftCols<3>() = -M_X;
    J.extrinsics.rightCols<3>() = M * G * core::skew(q);
    J.td = M * flow;
    J.readout = core::row_phase(row, rows) * J.td;
    J.point = M_X * body.R.transpose();
    return WorldPointView{*pixel, tau_s};
  }
  return std::nullopt;
}

}  // namespace plumbline::estimator
