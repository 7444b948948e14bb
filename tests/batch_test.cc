// The batch estimator on simulated recordings: the model's own error, conventions, blindness, outcomes.
#include <cmath>
#include <string>

#include <gtest/gtest.h>

#include "core/error.h"
#include "estimator/estimate.h"
#include "estimator/keyframes.h"
#include "estimator/triangulation.h"
#include "sim/simulate.h"

namespace plumbline {
namespace {

const core::ImuNoise kEurocLike{1.7e-4, 2e-5, 2e-3, 3e-3};

// A short recording, so that a test takes a fraction of a second.
sim::ScenarioConfig scenario() {
  sim::ScenarioConfig c;
  c.duration_s = 5.0;
  c.trajectory.handheld.rate_rms_rad_s = 0.75;
  c.camera.td_s = 0.02;
  c.camera.readout_s = 0.03;
  c.imu.noise = kEurocLike;
  c.world.landmarks = 2000;
  c.points.per_frame = 40;
  c.prior.td_sigma_s = 0.02;
  return c;
}

sim::ScenarioConfig noise_free_scenario(double imu_rate_hz) {
  sim::ScenarioConfig c = scenario();
  c.imu.rate_hz = imu_rate_hz;
  c.imu.noise = {};
  c.camera.pixel_sigma_px = 0.0;
  c.prior.means = sim::PriorMeans::kTruth;
  c.prior.start = sim::PriorStart::kDrawn;
  return c;
}

estimator::EstimatorConfig believing(const core::ImuNoise& noise, double pixel_sigma_px) {
  estimator::EstimatorConfig c;
  c.imu = {noise.gyro_noise_density, noise.gyro_bias_walk, noise.accel_noise_density, noise.accel_bias_walk};
  c.pixel_sigma_px = pixel_sigma_px;
  return c;
}

struct Errors {
  double td_s;
  double readout_s;
  double extrinsic_m;
  double position_rms_m;
};

Errors errors_of(const core::EstimateLog& estimate, const sim::GroundTruth& truth) {
  double sum = 0.0;
  for (const core::StampedState& s : estimate.states) {
    sum += (s.state.T_W_B.p - sim::state_at(truth, s.t_ns).T_W_B.p).squaredNorm();
  }
  return {estimate.calibration.td_s - truth.calibration.td_s,
          estimate.calibration.readout_s - truth.calibration.readout_s,
          (estimate.calibration.T_B_C.p - truth.calibration.T_B_C.p).norm(),
          std::sqrt(sum / static_cast<double>(estimate.states.size()))};
}

// Without noise all that is left is the midpoint rule: second order, so a quarter from each rate to the next.
TEST(Batch, NoiseFreeErrorIsTheIntegratorsAndFallsWithItsOrder) {
  const estimator::EstimatorConfig config = believing(kEurocLike, 1.0);
  Errors last{};
  for (const double rate : {200.0, 400.0, 800.0}) {
    const auto s = sim::simulate(noise_free_scenario(rate), {1, 0});
    const core::EstimateLog estimate = estimator::estimate(s.measurements, config);
    ASSERT_EQ(estimate.status, core::SolveStatus::kConverged) << estimate.reason;
    const Errors e = errors_of(estimate, s.truth);
    if (rate == 200.0) {
      EXPECT_LT(std::abs(e.td_s), 0.5e-6);
      EXPECT_LT(e.position_rms_m, 0.5e-3);
    } else {
      EXPECT_NEAR(last.td_s / e.td_s, 4.0, 0.6);
      EXPECT_NEAR(last.position_rms_m / e.position_rms_m, 4.0, 0.6);
      EXPECT_NEAR(last.extrinsic_m / e.extrinsic_m, 4.0, 0.6);
    }
    last = e;
  }
}

TEST(Batch, RecoversTdAndReadoutFromNoisyData) {
  for (const std::uint64_t trial : {0U, 1U, 2U}) {
    const auto s = sim::simulate(scenario(), {1, trial});
    const core::EstimateLog estimate = estimator::estimate(s.measurements, estimator::EstimatorConfig{});
    ASSERT_EQ(estimate.status, core::SolveStatus::kConverged) << estimate.reason;
    const Errors e = errors_of(estimate, s.truth);
    const auto sigma = [&](int i) { return std::sqrt(estimate.covariance(i, i)); };
    // 4.5 sigma: 7 in a million a quantity.
    EXPECT_LT(std::abs(e.td_s), 4.5 * sigma(core::kCovTd));
    EXPECT_LT(std::abs(e.readout_s), 4.5 * sigma(core::kCovReadout));
    // And the sigmas themselves are small: the prior's were 20 ms and 5 ms.
    EXPECT_LT(sigma(core::kCovTd), 0.3e-3);
    EXPECT_LT(sigma(core::kCovReadout), 1e-3);
    EXPECT_NEAR(estimate.summary.cost_per_dof(), 1.0, 0.12);  // about 4,000 degrees of freedom: 5 sigma
  }
}

// t_imu = t_cam + td: stamping the camera delta earlier and adding delta to td and its prior changes nothing.
TEST(Batch, ShiftingTheCameraClockShiftsTdOnly) {
  const auto s = sim::simulate(scenario(), {1, 3});
  const core::TimeNs delta_ns = 7'000'000;
  core::MeasurementLog shifted = s.measurements;
  for (core::Frame& frame : shifted.frames) frame.t_cam_ns -= delta_ns;
  shifted.prior.calibration.td_s += core::to_seconds(delta_ns);
  shifted.prior.start_calibration.td_s += core::to_seconds(delta_ns);
  const core::EstimateLog a = estimator::estimate(s.measurements, {});
  const core::EstimateLog b = estimator::estimate(shifted, {});
  ASSERT_EQ(a.status, core::SolveStatus::kConverged);
  ASSERT_EQ(b.status, core::SolveStatus::kConverged);
  // Equal but for the rounding of times, amplified by the solver: far below any sigma.
  EXPECT_NEAR(b.calibration.td_s - a.calibration.td_s, core::to_seconds(delta_ns), 1e-9);
  ASSERT_EQ(a.states.size(), b.states.size());
  for (std::size_t i = 0; i < a.states.size(); ++i) {
    EXPECT_EQ(a.states[i].t_ns, b.states[i].t_ns);
    EXPECT_LT((a.states[i].state.T_W_B.p - b.states[i].state.T_W_B.p).norm(), 1e-7);
  }
}

// What is held fixed stays at the prior's mean and has no covariance.
TEST(Batch, HoldsWhatIsNotFree) {
  sim::ScenarioConfig c = scenario();
  c.prior.readout_sigma_s = 0.0;
  const auto s = sim::simulate(c, {1, 0});
  estimator::EstimatorConfig config;
  config.estimate = {.td = true, .readout = false, .extrinsics = false};
  const core::EstimateLog estimate = estimator::estimate(s.measurements, config);
  ASSERT_EQ(estimate.status, core::SolveStatus::kConverged);
  EXPECT_EQ(estimate.calibration.readout_s, s.truth.calibration.readout_s);
  EXPECT_EQ(estimate.calibration.T_B_C.p, s.measurements.prior.calibration.T_B_C.p);
  EXPECT_EQ(estimate.covariance(core::kCovReadout, core::kCovReadout), 0.0);
  EXPECT_EQ(estimate.covariance.topLeftCorner(6, 6).norm(), 0.0);
  EXPECT_GT(estimate.covariance(core::kCovTd, core::kCovTd), 0.0);
  EXPECT_FALSE(estimate.readout_estimated);
}

TEST(Batch, BothSolversAgree) {
  const auto s = sim::simulate(scenario(), {1, 0});
  estimator::EstimatorConfig config;
  config.solver = estimator::LinearSolver::kDenseSchur;
  const core::EstimateLog dense = estimator::estimate(s.measurements, config);
  config.solver = estimator::LinearSolver::kSparseSchur;
  const core::EstimateLog sparse = estimator::estimate(s.measurements, config);
  // Both stop within 1e-9 of the minimal cost: a thousandth of a sigma (0.1 us).
  EXPECT_NEAR(dense.calibration.td_s, sparse.calibration.td_s, 2e-7);
}

TEST(Batch, AFalseMinimumIsNotAnAnswer) {
  const auto s = sim::simulate(scenario(), {1, 0});
  // Believing in a tenth of the pixel noise leaves 100 times the cost.
  const core::EstimateLog estimate = estimator::estimate(s.measurements, believing(kEurocLike, 0.1));
  EXPECT_EQ(estimate.status, core::SolveStatus::kFalseMinimum);
  EXPECT_NE(estimate.reason.find("max_cost_per_dof"), std::string::npos);
}

TEST(Batch, TooFewIterationsIsAStatus) {
  const auto s = sim::simulate(scenario(), {1, 0});
  estimator::EstimatorConfig config;
  config.max_iterations = 1;
  EXPECT_EQ(estimator::estimate(s.measurements, config).status, core::SolveStatus::kIterationLimit);
}

TEST(Batch, NoFramesIsAFailedInitialisation) {
  auto s = sim::simulate(scenario(), {1, 0});
  s.measurements.frames.clear();
  const core::EstimateLog estimate = estimator::estimate(s.measurements, {});
  EXPECT_EQ(estimate.status, core::SolveStatus::kFailedInitialisation);
  EXPECT_FALSE(estimate.reason.empty());
}

TEST(Batch, RefusesNoiseAndPriorsWithoutWidth) {
  const auto noise_free = sim::simulate(noise_free_scenario(200.0), {1, 0});
  EXPECT_THROW(estimator::estimate(noise_free.measurements, {}), core::ConfigError);
  sim::ScenarioConfig c = scenario();
  c.prior.td_sigma_s = 0.0;
  EXPECT_THROW(estimator::estimate(sim::simulate(c, {1, 0}).measurements, {}), core::ConfigError);
}

TEST(Keyframes, RateAndTracks) {
  std::vector<core::Frame> frames;
  for (int i = 0; i < 40; ++i) {
    frames.push_back({core::to_ns(i / 20.0), {{i < 2 ? 5 : 6, {1.0, 2.0}}}});
  }
  const auto keyframes = estimator::select_keyframes(frames, 10.0);
  ASSERT_EQ(keyframes.size(), 20U);
  for (std::size_t i = 0; i < keyframes.size(); ++i) EXPECT_EQ(keyframes[i], 2 * i);
  EXPECT_EQ(estimator::select_keyframes(frames, 100.0).size(), frames.size());
  const auto tracks = estimator::collect_tracks(frames, keyframes, {});
  ASSERT_EQ(tracks.size(), 1U);  // track 5 is in one keyframe only
  EXPECT_EQ(tracks.front().id, 6);
  EXPECT_EQ(tracks.front().observations.front().keyframe, 1U);
}

TEST(Triangulation, ExactRaysGiveTheExactDepth) {
  const core::PinholeCamera camera;
  const Eigen::Vector3d P(0.3, -0.2, 4.0);
  std::vector<estimator::View> views;
  for (const double x : {0.0, 0.2, 0.5}) {
    const core::Pose T{core::exp_quaternion(Eigen::Vector3d(0.05 * x, -0.1 * x, 0.02)), {x, 0.1 * x, -0.3 * x}};
    views.push_back({T, *camera.project(T.inverse() * P)});
  }
  const Eigen::Vector3d landmark = estimator::triangulate(camera, views);
  EXPECT_NEAR(landmark.z(), 1.0 / (views.front().T_W_C.inverse() * P).z(), 1e-12);
  // No baseline, no parallax: the farthest plausible depth.
  EXPECT_NEAR(estimator::triangulate(camera, {views[0], views[0]}).z(), 0.01, 1e-12);
}

}  // namespace
}  // namespace plumbline
