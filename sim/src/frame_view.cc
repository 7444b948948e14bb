#include "sim/frame_view.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace plumbline::sim {

double half_angle_of_view_rad(const core::PinholeCamera& camera) {
  // The corners are furthest from the axis but for the tangential part of a lens, which the border's other pixels and
  // the margin cover.
  constexpr int kSteps = 16;
  constexpr double kMargin = 1.02;
  constexpr double kAll = 0.5 * std::numbers::pi;
  double half_angle = 0.0;
  const auto cover = [&](double u, double v) {
    const auto bearing = camera.try_unproject({u, v});
    half_angle = std::max(half_angle, bearing ? kMargin * std::acos(1.0 / bearing->norm()) : kAll);
  };
  for (int i = 0; i <= kSteps; ++i) {
    const double u = camera.width_px * static_cast<double>(i) / kSteps - 0.5;
    const double v = camera.height_px * static_cast<double>(i) / kSteps - 0.5;
    cover(u, -0.5);
    cover(u, camera.height_px - 0.5);
    cover(-0.5, v);
    cover(camera.width_px - 0.5, v);
  }
  return std::min(half_angle, kAll);
}

FrameView::FrameView(const Trajectory& trajectory, const core::PinholeCamera& camera,
                     const core::RigCalibration& calibration, double half_angle_rad, double t_cam_s)
    : trajectory_(trajectory), camera_(camera), calibration_(calibration), t_middle_s_(t_cam_s + calibration.td_s) {
  const Kinematics k = trajectory.at(t_middle_s_);
  const core::Pose T_W_C = k.T_W_B * calibration.T_B_C;
  T_W_C_middle_ = T_W_C;
  T_C_W_middle_ = T_W_C.inverse();
  const Eigen::Vector3d v_W = k.v_W + k.T_W_B.q * k.omega_B.cross(calibration.T_B_C.p);
  v_C_ = T_C_W_middle_.q * v_W;
  omega_C_ = calibration.T_B_C.q.conjugate() * k.omega_B;

  // Twice the motion that the middle row's speed and rate predict, so that their change is covered.
  const double half_readout_s = 0.5 * std::abs(calibration.readout_s);
  turn_rad_ = 2.0 * omega_C_.norm() * half_readout_s;
  reach_m_ = 2.0 * v_C_.norm() * half_readout_s;
  cos_half_angle_ = std::cos(std::min(half_angle_rad + turn_rad_, std::numbers::pi));
}

core::Pose FrameView::camera_pose_at(double t_imu_s) const { return trajectory_.pose_at(t_imu_s) * calibration_.T_B_C; }

bool FrameView::may_see(const Eigen::Vector3d& P_W, double nearest_m, double farthest_m) const {
  const Eigen::Vector3d P_C = T_C_W_middle_ * P_W;
  const double margin_m = reach_m(P_C.norm());
  if (P_C.z() < nearest_m - margin_m || P_C.z() > farthest_m + margin_m) return false;
  return P_C.z() + reach_m_ > cos_half_angle_ * (P_C.norm() - reach_m_);
}

std::optional<FrameView::MiddleRow> FrameView::at_middle_row(const Eigen::Vector3d& P_W) const {
  const double s_per_row = calibration_.readout_s / camera_.height_px;
  const double middle_row = 0.5 * camera_.height_px;
  Eigen::Matrix<double, 2, 3> J;
  MiddleRow m;
  m.P_C = T_C_W_middle_ * P_W;
  const auto pixel = camera_.project(m.P_C, &J);
  if (!pixel) return std::nullopt;
  m.pixel = *pixel;
  // dP_C/dt = -v_C - omega_C x P_C
  m.P_C_dot = -v_C_ - omega_C_.cross(m.P_C);
  m.flow = J * m.P_C_dot;
  m.slope = 1.0 - m.flow.y() * s_per_row;
  // The picture of a landmark that moves as fast as the shutter has no unique row.
  if (m.slope < 0.2) return std::nullopt;
  m.row = middle_row + (m.pixel.y() - middle_row) / m.slope;
  return m;
}

std::optional<Exposure> FrameView::glance(const Eigen::Vector3d& P_W) const {
  const auto m = at_middle_row(P_W);
  if (!m) return std::nullopt;
  const double dt_s = (m->row / camera_.height_px - 0.5) * calibration_.readout_s;
  const Eigen::Vector3d camera_C = v_C_ * dt_s;
  return Exposure{.pixel = m->pixel + dt_s * m->flow,
                  .t_imu_s = t_middle_s_ + dt_s,
                  .depth_m = m->P_C.z() + dt_s * m->P_C_dot.z(),
                  .camera_W = T_W_C_middle_ * camera_C};
}

std::optional<Exposure> FrameView::expose(const Eigen::Vector3d& P_W) const {
  const double s_per_row = calibration_.readout_s / camera_.height_px;
  const double middle_row = 0.5 * camera_.height_px;
  const auto m = at_middle_row(P_W);
  if (!m) return std::nullopt;

  constexpr int kMaxIterations = 50;
  constexpr double kToleranceS = 1e-12;
  double v = m->row;
  for (int i = 0; i < kMaxIterations; ++i) {
    const double t = t_middle_s_ + (v - middle_row) * s_per_row;
    const core::Pose T_W_C = camera_pose_at(t);
    const Eigen::Vector3d P_C = T_W_C.inverse() * P_W;
    const auto pixel = camera_.project(P_C);
    if (!pixel) return std::nullopt;
    const double defect = pixel->y() - v;
    if (std::abs(defect * s_per_row) < kToleranceS) {
      return Exposure{.pixel = *pixel, .t_imu_s = t, .depth_m = P_C.z(), .camera_W = T_W_C.p};
    }
    v += defect / m->slope;
  }
  return std::nullopt;
}

Eigen::Vector2d FrameView::image_velocity(const Eigen::Vector3d& P_W, double t_imu_s) const {
  const Kinematics k = trajectory_.at(t_imu_s);
  const core::Pose& T_B_C = calibration_.T_B_C;
  const Eigen::Vector3d P_B = k.T_W_B.inverse() * P_W;
  const Eigen::Vector3d P_C = T_B_C.inverse() * P_B;
  // dP_B/dt = -R_W_B^T v_W - omega_B x P_B
  const Eigen::Vector3d P_B_dot = -(k.T_W_B.q.conjugate() * k.v_W) - k.omega_B.cross(P_B);
  const Eigen::Vector3d P_C_dot = T_B_C.q.conjugate() * P_B_dot;
  return (P_C_dot.head<2>() - P_C.head<2>() * (P_C_dot.z() / P_C.z())) / P_C.z();
}

}  // namespace plumbline::sim
