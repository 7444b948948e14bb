// Simulator and estimator speak of the same world: the IMU integrates to the trajectory, and at the truth the factors
// leave exactly the simulated noise.
#include <cmath>
#include <map>
#include <memory>

#include <gtest/gtest.h>

#include "estimator/factors/imu_factor.h"
#include "estimator/factors/point_factors.h"
#include "estimator/keyframes.h"
#include "sim/frame_view.h"
#include "sim/simulate.h"
#include "whitened_moments.h"

namespace plumbline {
namespace {

sim::ScenarioConfig scenario() {
  sim::ScenarioConfig c;
  c.duration_s = 6.0;
  c.trajectory.handheld.rate_rms_rad_s = 0.75;
  c.imu.gyro_bias_rad_s = {0.01, -0.02, 0.015};
  c.imu.accel_bias_m_s2 = {0.05, -0.08, 0.03};
  c.camera.td_s = 0.02;
  c.camera.readout_s = 0.03;
  c.world.landmarks = 3000;
  return c;
}

// Handheld motion and two loops (scenarios_test has the others): a second of dead reckoning from the true state ends at
// the true state, up to the midpoint rule's error, which a doubled rate divides by four.
TEST(Consistency, IntegratedImuReproducesTheTrajectoryAtSecondOrder) {
  for (const auto type :
       {sim::TrajectoryType::kHandheld, sim::TrajectoryType::kFigureEight, sim::TrajectoryType::kCircle}) {
    double last_position = 0.0;
    double last_rotation = 0.0;
    for (const double rate : {200.0, 400.0, 800.0}) {
      sim::ScenarioConfig c = scenario();
      c.trajectory.type = type;
      c.imu.rate_hz = rate;
      const auto s = sim::simulate(c, {3, 0});
      const auto samples = static_cast<std::size_t>(rate);
      const core::State end =
          estimator::carry(s.truth.states.front().state, s.measurements.imu, 0, samples, c.gravity_m_s2);
      const core::StateTangent error = core::minus(end, s.truth.states[samples].state);
      const double position = error.segment<3>(core::kPosition).norm();
      const double rotation = error.segment<3>(core::kOrientation).norm();
      if (rate == 200.0) {
        EXPECT_LT(position, 2e-4);
        EXPECT_LT(rotation, 2e-5);
      } else {
        EXPECT_NEAR(last_position / position, 4.0, 0.3);
        EXPECT_NEAR(last_rotation / rotation, 4.0, 0.3);
      }
      last_position = position;
      last_rotation = rotation;
    }
  }
}

TEST(Consistency, InertialResidualsAtTheTruthAreWhite) {
  sim::ScenarioConfig c = scenario();
  c.duration_s = 60.0;
  c.imu.noise = {1.7e-4, 2e-5, 2e-3, 3e-3};
  const auto s = sim::simulate(c, {3, 1});
  constexpr std::size_t kStep = 20;
  Eigen::Matrix<double, 15, 1> mean_square = Eigen::Matrix<double, 15, 1>::Zero();
  int n = 0;
  for (std::size_t i = 0; i + kStep < s.truth.states.size(); i += kStep, ++n) {
    const core::State& from = s.truth.states[i].state;
    const core::State& to = s.truth.states[i + kStep].state;
    const auto preintegration = estimator::preintegrate(std::span(s.measurements.imu).subspan(i, kStep + 1), from.bias,
                                                        s.measurements.imu_noise);
    const estimator::ImuFactor factor(preintegration, c.gravity_m_s2);
    const estimator::StateBlock x_i = estimator::pack(from);
    const estimator::StateBlock x_j = estimator::pack(to);
    const std::array<const double*, 2> blocks = {x_i.data(), x_j.data()};
    Eigen::Matrix<double, 15, 1> r;
    ASSERT_TRUE(factor.Evaluate(blocks.data(), r.data(), nullptr));
    mean_square += r.cwiseAbs2();
  }
  mean_square /= n;
  // chi2(n)/n with n = 599: sqrt(2/n) = 5.8 %; 4.5 sigma, and 2.5 % for the noise that neighbouring steps share.
  for (int i = 0; i < 15; ++i) EXPECT_NEAR(mean_square[i], 1.0, 0.29) << i;
}

TEST(Consistency, PointResidualsAtTheTruthAreTheSimulatedPixelNoise) {
  sim::ScenarioConfig c = scenario();
  c.camera.pixel_sigma_px = 0.7;
  c.imu.rate_hz = 800.0;  // so that the integrator's own error is far below the noise
  const auto s = sim::simulate(c, {3, 2});
  const core::MeasurementLog& log = s.measurements;
  const auto trajectory = sim::make_trajectory(c.trajectory, c.duration_s, {3, 2});
  const core::RigCalibration& rig = s.truth.calibration;
  const estimator::PoseBlock extrinsics = estimator::pack(rig.T_B_C);
  const estimator::CameraModel model{log.camera, c.camera.pixel_sigma_px, c.gravity_m_s2};

  const auto keyframes = estimator::select_keyframes(log.frames, 10.0);
  std::vector<estimator::FrameTiming> timings;
  std::vector<estimator::StateBlock> states;
  for (const std::size_t frame : keyframes) {
    const double t_s = core::to_seconds(log.frames[frame].t_cam_ns) + rig.td_s;
    const auto sample = static_cast<std::size_t>(std::llround(t_s * c.imu.rate_hz));
    const core::State& state = s.truth.states[sample].state;
    timings.push_back({std::make_shared<estimator::LocalMotion>(log.imu, sample, 0.05, state.bias),
                       core::to_seconds(log.frames[frame].t_cam_ns - log.imu[sample].t_ns)});
    states.push_back(estimator::pack(state));
  }

  testing::WhitenedMoments moments;
  for (const estimator::Track& track : estimator::collect_tracks(log.frames, keyframes, log.camera)) {
    const std::size_t anchor = track.observations.front().keyframe;
    const Eigen::Vector3d& P_W = s.truth.landmarks_W[static_cast<std::size_t>(s.truth.track_landmark.at(track.id))];
    const sim::FrameView view(*trajectory, log.camera, rig, sim::half_angle_of_view_rad(log.camera),
                              core::to_seconds(log.frames[keyframes[anchor]].t_cam_ns));
    const auto exposure = view.expose(P_W);
    ASSERT_TRUE(exposure.has_value());
    Eigen::Vector3d landmark = log.camera.unproject(exposure->pixel);
    landmark.z() = 1.0 / exposure->depth_m;
    for (auto o = track.observations.begin() + 1; o != track.observations.end(); ++o) {
      const estimator::PropagatedPointFactor factor(model, timings[anchor], timings[o->keyframe], o->pixel);
      const std::array<const double*, 6> blocks = {states[anchor].data(), states[o->keyframe].data(),
                                                   extrinsics.data(),     &rig.td_s,
                                                   &rig.readout_s,        landmark.data()};
      Eigen::Vector2d r;
      ASSERT_TRUE(factor.Evaluate(blocks.data(), r.data(), nullptr));
      moments.add(r);
    }
  }
  ASSERT_GT(moments.n, 3000);
  moments.expect_standard_normal();
}

}  // namespace
}  // namespace plumbline
