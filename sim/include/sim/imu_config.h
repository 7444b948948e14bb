// The keys of scenario.imu: the inertial sensor and its defects, all off by default (docs/sensors.md).
#pragma once

#include <optional>

#include <Eigen/Core>

#include "core/calibration.h"
#include "core/config.h"
#include "core/error.h"

namespace plumbline::sim {

// What one triad of axes does to its input; the equation is that of sim/imu_sensor.h. Limits and steps of 0 are none.
struct TriadDefects {
  Eigen::Vector3d scale_error = Eigen::Vector3d::Zero();                               // of each axis
  Eigen::Matrix<double, 6, 1> misalignment_rad = Eigen::Matrix<double, 6, 1>::Zero();  // xy, xz, yx, yz, zx, zy
  Eigen::Vector3d noise_factor = Eigen::Vector3d::Ones();                              // of the white noise
  double saturation = 0.0;
  double quantisation = 0.0;
};

struct ImuConfig {
  double rate_hz = 200.0;
  core::ImuNoise noise;                                       // as the data sheet states it
  Eigen::Vector3d gyro_bias_rad_s = Eigen::Vector3d::Zero();  // at the start
  Eigen::Vector3d accel_bias_m_s2 = Eigen::Vector3d::Zero();
  TriadDefects gyro;
  TriadDefects accel;
  Eigen::Matrix<double, 9, 1> g_sensitivity = Eigen::Matrix<double, 9, 1>::Zero();  // row by row
  double stamp_jitter_s = 0.0;
  double dropout_probability = 0.0;
  int dropout_samples = 1;
};

void visit(core::ConfigVisitor& v, ImuConfig& c);
std::optional<core::RuleViolation> validate(const ImuConfig& c);

}  // namespace plumbline::sim
