// The keys of scenario.imu: the inertial sensor.
#pragma once

#include <Eigen/Core>

#include "core/calibration.h"
#include "core/config.h"

namespace plumbline::sim {

struct ImuConfig {
  double rate_hz = 200.0;
  core::ImuNoise noise;
  Eigen::Vector3d gyro_bias_rad_s = Eigen::Vector3d::Zero();  // at the start
  Eigen::Vector3d accel_bias_m_s2 = Eigen::Vector3d::Zero();
};

void visit(core::ConfigVisitor& v, ImuConfig& c);

}  // namespace plumbline::sim
