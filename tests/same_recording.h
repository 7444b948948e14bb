// A recording with a bit of everything, and whether two are the same.
#pragma once

#include <algorithm>
#include <vector>

#include <gtest/gtest.h>

#include "core/measurements.h"
#include "sim/simulate.h"

namespace plumbline::sim {

inline ScenarioConfig some_config() {
  ScenarioConfig config;
  config.duration_s = 2.0;
  config.imu.noise = {
      .gyro_noise_density = 1.7e-4, .gyro_bias_walk = 2e-5, .accel_noise_density = 2e-3, .accel_bias_walk = 3e-3};
  config.imu.gyro_bias_rad_s = {0.01, -0.02, 0.015};
  config.imu.accel_bias_m_s2 = {0.05, -0.08, 0.03};
  config.camera.td_s = 0.02;
  config.camera.readout_s = 0.03;
  config.camera.model.distortion = {core::DistortionModel::kRadtan, {-0.283, 0.074, 2e-4, 2e-5}};
  config.world.landmarks = 500;
  config.points.per_frame = 30;
  config.points.loss_probability = 0.05;
  config.prior.start = PriorStart::kDrawn;
  return config;
}

// Equality of every number, to the bit but for the sign of zero.
inline bool same(const core::Pose& a, const core::Pose& b) { return a.p == b.p && a.q.coeffs() == b.q.coeffs(); }

inline bool same(const core::State& a, const core::State& b) {
  return same(a.T_W_B, b.T_W_B) && a.v_W == b.v_W && a.bias.gyro_rad_s == b.bias.gyro_rad_s &&
         a.bias.accel_m_s2 == b.bias.accel_m_s2;
}

inline bool same(const core::RigCalibration& a, const core::RigCalibration& b) {
  return same(a.T_B_C, b.T_B_C) && a.td_s == b.td_s && a.readout_s == b.readout_s && a.intrinsics == b.intrinsics;
}

inline bool same(const std::vector<core::ImuSample>& a, const std::vector<core::ImuSample>& b) {
  return std::ranges::equal(a, b, [](const core::ImuSample& x, const core::ImuSample& y) {
    return x.t_ns == y.t_ns && x.gyro_rad_s == y.gyro_rad_s && x.accel_m_s2 == y.accel_m_s2;
  });
}

inline bool same(const std::vector<core::Frame>& a, const std::vector<core::Frame>& b) {
  const auto same_point = [](const core::PointObservation& x, const core::PointObservation& y) {
    return x.track_id == y.track_id && x.pixel == y.pixel && x.velocity == y.velocity;
  };
  const auto same_line = [](const core::LineObservation& x, const core::LineObservation& y) {
    return x.track_id == y.track_id && x.ends_px == y.ends_px && x.velocities == y.velocities;
  };
  return std::ranges::equal(a, b, [&](const core::Frame& x, const core::Frame& y) {
    return x.t_cam_ns == y.t_cam_ns && std::ranges::equal(x.points, y.points, same_point) &&
           std::ranges::equal(x.lines, y.lines, same_line);
  });
}

inline bool same(const core::InitialPrior& a, const core::InitialPrior& b) {
  const core::CalibrationSigmas& s = a.calibration_sigma;
  const core::CalibrationSigmas& t = b.calibration_sigma;
  return a.t_ns == b.t_ns && same(a.mean, b.mean) && a.sigma.per_axis() == b.sigma.per_axis() &&
         same(a.calibration, b.calibration) && s.td_s == t.td_s && s.readout_s == t.readout_s &&
         s.extrinsic_position_m == t.extrinsic_position_m && s.extrinsic_rotation_rad == t.extrinsic_rotation_rad &&
         s.focal_px == t.focal_px && s.principal_point_px == t.principal_point_px && same(a.start, b.start) &&
         same(a.start_calibration, b.start_calibration);
}

inline void expect_same(const core::MeasurementLog& a, const core::MeasurementLog& b) {
  EXPECT_TRUE(same(a.imu, b.imu));
  EXPECT_TRUE(same(a.frames, b.frames));
  EXPECT_TRUE(same(a.prior, b.prior));
  EXPECT_EQ(a.camera.width_px, b.camera.width_px);
  EXPECT_EQ(a.camera.height_px, b.camera.height_px);
  EXPECT_EQ(a.camera.fx_px, b.camera.fx_px);
  EXPECT_EQ(a.camera.fy_px, b.camera.fy_px);
  EXPECT_EQ(a.camera.cx_px, b.camera.cx_px);
  EXPECT_EQ(a.camera.cy_px, b.camera.cy_px);
  EXPECT_EQ(a.camera.distortion.model(), b.camera.distortion.model());
  EXPECT_EQ(a.camera.distortion.coefficients(), b.camera.distortion.coefficients());
  EXPECT_EQ(a.imu_noise.gyro_noise_density, b.imu_noise.gyro_noise_density);
  EXPECT_EQ(a.imu_noise.gyro_bias_walk, b.imu_noise.gyro_bias_walk);
  EXPECT_EQ(a.imu_noise.accel_noise_density, b.imu_noise.accel_noise_density);
  EXPECT_EQ(a.imu_noise.accel_bias_walk, b.imu_noise.accel_bias_walk);
  EXPECT_EQ(a.pixel_sigma_px, b.pixel_sigma_px);
  EXPECT_EQ(a.line_sigma_px, b.line_sigma_px);
  EXPECT_EQ(a.gravity_m_s2, b.gravity_m_s2);
}

inline void expect_same(const GroundTruth& a, const GroundTruth& b) {
  EXPECT_TRUE(same(a.calibration, b.calibration));
  EXPECT_TRUE(std::ranges::equal(a.states, b.states, [](const core::StampedState& x, const core::StampedState& y) {
    return x.t_ns == y.t_ns && same(x.state, y.state);
  }));
  EXPECT_EQ(a.landmarks_W, b.landmarks_W);
  EXPECT_EQ(a.track_landmark, b.track_landmark);
  EXPECT_TRUE(std::ranges::equal(a.segments_W, b.segments_W, {}, &Segment::ends_W, &Segment::ends_W));
  EXPECT_EQ(a.track_segment, b.track_segment);
  EXPECT_TRUE(std::ranges::equal(a.line_ends, b.line_ends, [](const LineEnds& x, const LineEnds& y) {
    return x.frame_ns == y.frame_ns && x.track_id == y.track_id && x.segment == y.segment && x.t_imu_s == y.t_imu_s &&
           x.ends_px == y.ends_px;
  }));
}

}  // namespace plumbline::sim
