// What a trial is measured by. A new metric is one line here and its value in eval/evaluate.h.
//
//   name                  value                                              NEES (never after alignment)
//   ate_position_m        RMSE over the trajectory, aligned                  -
//   ate_rotation_deg      likewise, geodesic angle                           -
//   td_error_s            estimate - truth, middle row                       1 dof, where estimated
//   td_first_error_s      likewise, first row: td_middle - readout/2         1 dof, from the joint covariance of both
//   readout_error_s       estimate - truth                                   1 dof, where estimated
//   extrinsic_position_m  |p_est - p_true| of T_B_C                          3 dof, where estimated
//   extrinsic_rotation_deg  |Log(R_true^T R_est)| of T_B_C                   3 dof, where estimated
//   extrinsic             m, as extrinsic_position_m                         6 dof, [position | orientation] jointly
//   focal_error_px        |(fx, fy)_est - (fx, fy)_true|                     2 dof; these three where estimated only
//   principal_point_error_px  likewise of (cx, cy)                           2 dof
//   intrinsics            px, likewise of (fx, fy, cx, cy)                   4 dof
//   calibration           m, as extrinsic_position_m                         all of T_B_C, td, readout and intrinsics
//                                                                            that is free
//   final_pose            m, |p_est - p_true| of the last state, unaligned   6 dof, [position | orientation] jointly
//   final_position        m, the same                                        3 dof
//   final_orientation_deg  |Log(R_true^T R_est)| of the last state           3 dof
//   final_velocity        m/s, norm of the error of the last state           3 dof
//   final_gyro_bias       rad/s, norm of the error of the last state         3 dof
//   final_accel_bias      m/s^2, norm of the error of the last state         3 dof
//   final_bias            rad/s, as final_gyro_bias                          6 dof, [gyroscope | accelerometer] jointly
//   final_state           m, as final_pose                                   15 dof
//   joint                 m, as final_pose                                   calibration and final_state jointly
//   nis_visual            mean squared whitened residual at the solution     -
//   nis_inertial          likewise; both are below 1 where the noise is as stated, since parameters were fitted to them
//   line_angle_deg        median over the trial's lines of the angle from the true direction (eval/line_error.h)    -
//   line_distance_m       likewise of the distance of the true segment's ends from the line                      -
//   line_share            lines that were estimated / tracks of lines in two keyframes or more
//                         The three only where lines were used, the first two only where one was estimated.
//   kappa2                of the bound, see eval/cramer_rao.h; only with eval.crlb
//   restarts              how often the estimator began anew after a failure; only where it may
//   knot_interval_s       of a trajectory spline; only with estimator.timing: spline
//   knot_excess           likewise: how far the IMU's residuals exceed their noise, in sigmas (core::KnotCheck)
//   td_convergence_s      since the first estimated state: the first instant after which |td error| stays within
//                         eval.td_bound_s for the rest; only where the estimator keeps a history of td
//   init_time_s           of data, from the first IMU sample to the newest state; these six where the estimate began
//                         from scratch (eval/initialisation_error.h)
//   init_aligned_scale_error  relative, by geometry alone                    -
//   init_scale_error      relative, refined                                  1 dof
//   init_gravity_deg      angle, of the newest refined state                 -
//   init_velocity_m_s     norm, in the body frame                            -
//   init_gyro_bias_rad_s  norm                                               -
// A joint block's units do not mix in a norm, so its value is that of the position in it.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>

#include "core/lie.h"

namespace plumbline::eval {

struct Metric {
  std::string name;
  double value = 0.0;
  std::optional<double> nees = std::nullopt;
  int nees_dof = 0;                           // 0 where there is no NEES
  std::optional<double> crlb = std::nullopt;  // Cramer-Rao bound of the value (eval/metric_bound.h)
  bool censored = false;                      // what is waited for had not happened by the end, which is the value
};

struct MetricInfo {
  std::string_view name;
  std::string_view label;   // in tables, with the unit
  double table_unit = 1.0;  // what a value is multiplied by in tables
  bool is_signed = false;   // a Gaussian error of mean 0 where the estimator is consistent
  bool in_table = true;     // false: the value repeats another metric's or is no error; only a NEES is shown
};

inline constexpr std::string_view kTdConvergence = "td_convergence_s";
inline constexpr std::string_view kKappa2 = "kappa2";
inline constexpr std::string_view kLineAngle = "line_angle_deg";
inline constexpr std::string_view kLineDistance = "line_distance_m";
inline constexpr std::string_view kLineShare = "line_share";

inline constexpr std::array<MetricInfo, 37> kMetrics = {{
    {"ate_position_m", "ATE position [mm]", 1e3},
    {"ate_rotation_deg", "ATE rotation [deg]", 1.0},
    {"td_error_s", "td error [us]", 1e6, true},
    {"td_first_error_s", "td error, first row [us]", 1e6, true},
    {"readout_error_s", "readout error [us]", 1e6, true},
    {"extrinsic_position_m", "extrinsic position [mm]", 1e3},
    {"extrinsic_rotation_deg", "extrinsic rotation [deg]", 1.0},
    {"extrinsic", "extrinsic, joint", 1e3, false, false},
    {"focal_error_px", "focal lengths [px]"},
    {"principal_point_error_px", "principal point [px]"},
    {"intrinsics", "intrinsics, joint", 1.0, false, false},
    {"calibration", "calibration, joint", 1e3, false, false},
    {"final_pose", "final pose [mm]", 1e3},
    {"final_position", "final position", 1e3, false, false},
    {"final_orientation_deg", "final orientation [deg]", 1.0},
    {"final_velocity", "final velocity [mm/s]", 1e3},
    {"final_gyro_bias", "final gyro bias [deg/h]", 3600.0 * core::kDegreesPerRadian},
    {"final_accel_bias", "final accel bias [mm/s2]", 1e3},
    {"final_bias", "final biases, joint", 3600.0 * core::kDegreesPerRadian, false, false},
    {"final_state", "final state, joint", 1e3, false, false},
    {"joint", "calibration and state", 1e3, false, false},
    {"nis_visual", "visual residuals, squared", 1.0, false, false},
    {"nis_inertial", "inertial residuals, squared", 1.0, false, false},
    {kLineAngle, "line direction [deg]", 1.0},
    {kLineDistance, "line distance [mm]", 1e3},
    {kLineShare, "lines estimated, share", 1.0, false, false},
    {"restarts", "restarts a trial", 1.0, false, false},
    {"knot_interval_s", "interval of knots [s]", 1.0, false, false},
    {"knot_excess", "IMU residuals over noise [sigma]", 1.0, false, false},
    {kTdConvergence, "td convergence [s]", 1.0, false, false},
    {"init_time_s", "time to initialise [s]"},
    {"init_aligned_scale_error", "initial scale, aligned [%]", 100.0},
    {"init_scale_error", "initial scale [%]", 100.0, true},
    {"init_gravity_deg", "initial gravity [deg]"},
    {"init_velocity_m_s", "initial velocity [mm/s]", 1e3},
    {"init_gyro_bias_rad_s", "initial gyro bias [deg/h]", 3600.0 * core::kDegreesPerRadian},
    {kKappa2, "kappa2 of the bound", 1.0, false, false},
}};

// As outputs state it; what covariances and NEES speak of.
inline constexpr std::string_view kErrorDefinition =
    "estimate - truth for positions, velocities, biases, td and readout, Log(R_truth^T R_est) for orientations; "
    "unaligned, but for the ATE";

// A metric that is not listed is shown under its own name and unit.
constexpr MetricInfo metric_info(std::string_view name) {
  for (const MetricInfo& info : kMetrics) {
    if (info.name == name) return info;
  }
  return {name, name};
}

}  // namespace plumbline::eval
