// The body's motion by the IMU alone, from the first of some times to each: what preintegration sums up, at any time.
//   samples between times are linear in time, the steps those of imu_increment.h
#pragma once

#include <span>
#include <vector>

#include <Eigen/Core>

#include "core/measurements.h"
#include "core/time.h"
#include "estimator/factors/imu_increment.h"

namespace plumbline::estimator {

struct ImuPath {
  std::vector<double> t_s;              // since the first time
  std::vector<ImuIncrement> motion;     // from the first time, in the body frame of that time
  std::vector<Eigen::Vector3d> rate_B;  // w_m - b_g [rad/s] at each
};

// At origin_ns + stamps_s + td, stamps that ascend (camera clock). Before the first sample and after the last the
// nearest one holds.
ImuPath imu_path(std::span<const core::ImuSample> imu, core::TimeNs origin_ns, std::span<const double> stamps_s,
                 double td_s, const core::ImuBias& bias);

}  // namespace plumbline::estimator
