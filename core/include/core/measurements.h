// All that an estimator is given: what a real rig would deliver, and what its user would know beforehand.
#pragma once

#include <array>
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

// A segment as a detector reports it: its two ends, each exposed with its own row. Neither end need be the same place
// on the line from frame to frame: pictures end, detectors cut short.
struct LineObservation {
  std::int64_t track_id = 0;  // numbered apart from those of points
  std::array<Eigen::Vector2d, 2> ends_px = {Eigen::Vector2d::Zero(), Eigen::Vector2d::Zero()};
  // Of each end, in normalised coordinates, 1/s; absent where none is known.
  std::optional<std::array<Eigen::Vector2d, 2>> velocities = std::nullopt;
};

struct Frame {
  TimeNs t_cam_ns = 0;  // camera clock
  std::vector<PointObservation> points = {};
  std::vector<LineObservation> lines = {};
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
  double pixel_sigma_px = 0.0;  // likewise, u and v of a point
  double line_sigma_px = 0.0;   // likewise, u and v of each end of a segment
  double gravity_m_s2 = 9.81;   // g_W = (0, 0, -gravity_m_s2)
};

}  // namespace plumbline::core
