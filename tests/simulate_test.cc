// What a trial draws anew, what it shares with others, and what of it is recorded.
#include "sim/simulate.h"

#include <algorithm>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "same_recording.h"

namespace plumbline::sim {
namespace {

TEST(Simulate, SameTrialSameNumbers) {
  const Simulation a = simulate(some_config(), {.seed = 3, .trial = 4});
  const Simulation b = simulate(some_config(), {.seed = 3, .trial = 4});
  expect_same(a.measurements, b.measurements);
  expect_same(a.truth, b.truth);
}

TEST(Simulate, TrialsShareTheSceneButNotTheNoise) {
  const ScenarioConfig config = some_config();
  const Simulation a = simulate(config, {.seed = 3, .trial = 0});
  const Simulation b = simulate(config, {.seed = 3, .trial = 1});
  EXPECT_EQ(a.truth.landmarks_W, b.truth.landmarks_W);
  EXPECT_TRUE(same(a.truth.calibration, b.truth.calibration));
  ASSERT_EQ(a.truth.states.size(), b.truth.states.size());
  for (std::size_t i = 0; i < a.truth.states.size(); ++i) {
    const core::State& x = a.truth.states[i].state;
    const core::State& y = b.truth.states[i].state;
    EXPECT_TRUE(same(x.T_W_B, y.T_W_B) && x.v_W == y.v_W) << i;
    EXPECT_EQ(x.bias.gyro_rad_s == y.bias.gyro_rad_s, i == 0) << i;  // walks from a common start
    EXPECT_EQ(x.bias.accel_m_s2 == y.bias.accel_m_s2, i == 0) << i;
    EXPECT_NE(a.measurements.imu[i].gyro_rad_s, b.measurements.imu[i].gyro_rad_s) << i;
    EXPECT_NE(a.measurements.imu[i].accel_m_s2, b.measurements.imu[i].accel_m_s2) << i;
  }
  EXPECT_EQ(a.truth.states.front().state.bias.gyro_rad_s, config.imu.gyro_bias_rad_s);
  EXPECT_EQ(a.truth.states.front().state.bias.accel_m_s2, config.imu.accel_bias_m_s2);
  EXPECT_NE(a.measurements.frames.front().points.front().pixel, b.measurements.frames.front().points.front().pixel);
  EXPECT_NE(a.truth.track_landmark, b.truth.track_landmark);  // other losses
  EXPECT_NE(a.measurements.prior.calibration.td_s, b.measurements.prior.calibration.td_s);
  EXPECT_FALSE(same(a.measurements.prior.mean, b.measurements.prior.mean));
}

TEST(Simulate, SeedsDifferInTheScene) {
  const Simulation a = simulate(some_config(), {.seed = 3, .trial = 0});
  const Simulation b = simulate(some_config(), {.seed = 4, .trial = 0});
  EXPECT_NE(a.truth.landmarks_W, b.truth.landmarks_W);
  EXPECT_FALSE(same(a.truth.states.front().state.T_W_B, b.truth.states.front().state.T_W_B));
}

// What one sensor suffers leaves the draws of the others alone.
TEST(Simulate, CameraSettingsLeaveTheImuAlone) {
  const Simulation reference = simulate(some_config(), {.seed = 3, .trial = 0});
  ScenarioConfig config = some_config();
  config.camera.pixel_sigma_px = 3.0;
  config.points.loss_probability = 0.3;
  config.points.per_frame = 10;
  const Simulation changed = simulate(config, {.seed = 3, .trial = 0});
  EXPECT_TRUE(same(changed.measurements.imu, reference.measurements.imu));
  EXPECT_TRUE(same(changed.measurements.prior, reference.measurements.prior));
  EXPECT_FALSE(same(changed.measurements.frames, reference.measurements.frames));
}

// Rows 0 to height of each frame within [lead, duration - lead], and no frame more would fit.
TEST(Simulate, FramesLieWithinTheRecording) {
  for (const double td_s : {-0.2, 0.0, 0.02, 0.6}) {
    for (const double readout_s : {0.0, 0.03}) {
      ScenarioConfig config = some_config();
      config.camera.td_s = td_s;
      config.camera.readout_s = readout_s;
      const std::vector<core::Frame> frames = simulate(config, {.seed = 3, .trial = 0}).measurements.frames;
      ASSERT_FALSE(frames.empty());
      const double first_s = core::to_seconds(frames.front().t_cam_ns) + td_s - 0.5 * readout_s;
      const double last_s = core::to_seconds(frames.back().t_cam_ns) + td_s + 0.5 * readout_s;
      constexpr double kNanosecond = 1e-9;  // of rounded stamps
      const double interval_s = 1.0 / config.camera.rate_hz;
      EXPECT_GE(first_s, kCameraLeadS - kNanosecond);
      EXPECT_LT(first_s - interval_s, kCameraLeadS + kNanosecond);
      EXPECT_LE(last_s, config.duration_s - kCameraLeadS + kNanosecond);
      EXPECT_GT(last_s + interval_s, config.duration_s - kCameraLeadS - kNanosecond);
      for (std::size_t i = 1; i < frames.size(); ++i) {
        EXPECT_EQ(frames[i].t_cam_ns - frames[i - 1].t_cam_ns, 50'000'000);
      }
    }
  }
}

TEST(Simulate, TruthAtAnInstant) {
  const GroundTruth truth = simulate(some_config(), {.seed = 3, .trial = 0}).truth;
  for (const std::size_t i : {std::size_t{0}, std::size_t{7}, truth.states.size() - 1}) {
    EXPECT_TRUE(same(state_at(truth, truth.states[i].t_ns), truth.states[i].state)) << i;
  }
  const core::State a = truth.states[7].state;
  const core::State b = truth.states[8].state;
  const core::State between = state_at(truth, truth.states[7].t_ns + 1'250'000);  // a quarter of 5 ms
  EXPECT_LT((core::minus(between, a) - 0.25 * core::minus(b, a)).norm(), 1e-14);
  EXPECT_THROW(state_at(truth, -1), core::DataError);
  EXPECT_THROW(state_at(truth, truth.states.back().t_ns + 1), core::DataError);
  EXPECT_THROW(state_at({}, 0), core::DataError);
}

}  // namespace
}  // namespace plumbline::sim
