// All that an estimator is given: what a real rig would deliver, and what its user would know beforehand.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "core/calibration.h"
#include "core/state.h"
#include "core/time.h"

namespace plumbline::core {

// w_m = w + b_g + n_g,   a_m = R_W_B^T (a_W - g_W) + b_a + n_a
struct ImuSample {
  TimeNs t_ns = 0;  // IMU clock
  Eigen::Vector3d gyro_rad_s = Eigen::Vector3d::Zero();
  Eigen::Vector3d accel_m_s2 = Eigen::Vector3d::Zero();
};

struct PointObservation {
  std::int64_t track_id = 0;  // one number a track; a landmark that is lost and found again gets a new one
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
  // Of the normalised coordinates (x, y), 1/s; absent where none is known.
  std::optional<Eigen::Vector2d> velocity = std::nullopt;
};

struct Frame {
  TimeNs t_cam_ns = 0;  // camera clock
  std::vector<PointObservation> points;
};

// What is known before the first image: itself a measurement, drawn about the truth. The state is that of the IMU
// sample at t_ns. Sigmas are of the perturbations of docs/conventions.md; in the calibration 0 means exactly known.
struct InitialPrior {
  TimeNs t_ns = 0;  // IMU clock, the stamp of an IMU sample
  State mean;
  StateSigmas sigma;
  RigCalibration calibration;
  CalibrationSigmas calibration_sigma;

  // Where to start iterating; the means above unless a study of convergence says otherwise.
  State start;
  RigCalibration start_calibration;
};

struct MeasurementLog {
  std::vector<ImuSample> imu;  // sorted by time
  std::vector<Frame> frames;   // sorted by time
  InitialPrior prior;
  PinholeCamera camera;
  ImuNoise imu_noise;           // as the data sheet states it
  double pixel_sigma_px = 0.0;  // likewise
  double gravity_m_s2 = 9.81;   // g_W = (0, 0, -gravity_m_s2)
};

}  // namespace plumbline::core
