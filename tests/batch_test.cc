// The batch estimator on simulated recordings: the model's own error, conventions, blindness, outcomes.
#include <cmath>
#include <limits>
#include <string>

#include <gtest/gtest.h>

#include "core/error.h"
#include "estimator/estimate.h"
#include "estimator/keyframes.h"
#include "estimator/triangulation.h"
#include "short_recording.h"
#include "sim/simulate.h"

namespace plumbline {
namespace {

using testing::believing;
using testing::Errors;
using testing::errors_of;
using testing::kEurocLike;

sim::ScenarioConfig scenario() { return testing::short_scenario(40); }

// Without noise all that is left is the midpoint rule: second order, so a quarter from each rate to the next.
TEST(Batch, NoiseFreeErrorIsTheIntegratorsAndFallsWithItsOrder) {
  const estimator::EstimatorConfig config = believing(kEurocLike, 1.0);
  Errors last{};
  for (const double rate : {200.0, 400.0, 800.0}) {
    const auto s = sim::simulate(testing::noise_free(scenario(), rate), {1, 0});
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

// The unit sphere is whitened like the picture: the same answer but for curvature, of relative order noise/f.
TEST(Batch, BothResidualsAgree) {
  const auto s = sim::simulate(scenario(), {1, 0});
  estimator::EstimatorConfig config;
  const core::EstimateLog pinhole = estimator::estimate(s.measurements, config);
  config.residual = estimator::ResidualType::kUnitSphere;
  const core::EstimateLog sphere = estimator::estimate(s.measurements, config);
  ASSERT_EQ(pinhole.status, core::SolveStatus::kConverged);
  ASSERT_EQ(sphere.status, core::SolveStatus::kConverged);
  const double sigma = std::sqrt(pinhole.covariance(core::kCovTd, core::kCovTd));
  EXPECT_LT(std::abs(sphere.calibration.td_s - pinhole.calibration.td_s), 0.1 * sigma);
  EXPECT_NEAR(std::sqrt(sphere.covariance(core::kCovTd, core::kCovTd)) / sigma, 1.0, 0.01);
}

// Every combination of timing, residual and landmark estimates td, from exact image velocities and light noise.
TEST(Batch, EveryPointModelFindsTd) {
  sim::ScenarioConfig c = scenario();
  c.camera.pixel_sigma_px = 0.2;
  c.points.velocity_source = sim::VelocitySource::kExact;
  const auto s = sim::simulate(c, {1, 0});
  for (const auto timing : {estimator::TimingModel::kPropagated, estimator::TimingModel::kFeatureVelocity}) {
    for (const auto residual : {estimator::ResidualType::kPinhole, estimator::ResidualType::kUnitSphere}) {
      for (const auto landmark :
           {estimator::LandmarkType::kBearingInverseDepth, estimator::LandmarkType::kFixedBearing}) {
        estimator::EstimatorConfig config;
        config.timing = timing;
        config.residual = residual;
        config.landmark = landmark;
        config.max_cost_per_dof =
            10.0;  // feature_velocity neglects image accelerations, fixed_bearing its anchors' noise
        const core::EstimateLog estimate = estimator::estimate(s.measurements, config);
        ASSERT_EQ(estimate.status, core::SolveStatus::kConverged) << estimate.reason;
        // The prior was 20 ms wide. Propagated is good to 0.1 ms here; the image velocity's model is not.
        const double tolerance = timing == estimator::TimingModel::kPropagated ? 0.3e-3 : 1.5e-3;
        EXPECT_LT(std::abs(errors_of(estimate, s.truth).td_s), tolerance)
            << static_cast<int>(timing) << static_cast<int>(residual) << static_cast<int>(landmark);
      }
    }
  }
}

// MATH's known defect of feature_velocity: with a velocity that is a difference of the same noisy pixels, the noise of
// p - a v is least at a = half the frames' interval, and td is pulled there. The states lie at the frames (td_k = 0).
TEST(Batch, FiniteDifferenceVelocitiesPullTd) {
  double error_s[2] = {};
  for (const bool exact : {true, false}) {
    sim::ScenarioConfig c = scenario();
    c.camera.td_s = 0.0;
    c.points.velocity_source = exact ? sim::VelocitySource::kExact : sim::VelocitySource::kFiniteDifference;
    const auto s = sim::simulate(c, {1, 0});
    estimator::EstimatorConfig config;
    config.timing = estimator::TimingModel::kFeatureVelocity;
    config.state_td_s = 0.0;
    const core::EstimateLog estimate = estimator::estimate(s.measurements, config);
    ASSERT_EQ(estimate.status, core::SolveStatus::kConverged) << estimate.reason;
    error_s[exact ? 0 : 1] = errors_of(estimate, s.truth).td_s;
  }
  EXPECT_GT(error_s[1] - error_s[0], 0.3e-3);
}

TEST(Batch, FeatureVelocityNeedsVelocities) {
  sim::ScenarioConfig c = scenario();
  c.points.velocity_source = sim::VelocitySource::kNone;
  estimator::EstimatorConfig config;
  config.timing = estimator::TimingModel::kFeatureVelocity;
  const core::EstimateLog estimate = estimator::estimate(sim::simulate(c, {1, 0}).measurements, config);
  EXPECT_EQ(estimate.status, core::SolveStatus::kFailedInitialisation);
  EXPECT_NE(estimate.reason.find("velocities"), std::string::npos);
}

// Where the states lie is a matter of the model, not of the answer.
TEST(Batch, StatesMayLieBesideTheFrames) {
  const auto s = sim::simulate(scenario(), {1, 0});
  estimator::EstimatorConfig config;
  const core::EstimateLog at_td = estimator::estimate(s.measurements, config);
  config.state_td_s = 0.0;
  const core::EstimateLog at_zero = estimator::estimate(s.measurements, config);
  ASSERT_EQ(at_td.status, core::SolveStatus::kConverged);
  ASSERT_EQ(at_zero.status, core::SolveStatus::kConverged);
  // What differs is the noise of the gap, which `propagated` neglects.
  EXPECT_NEAR(at_zero.calibration.td_s, at_td.calibration.td_s,
              0.3 * std::sqrt(at_td.covariance(core::kCovTd, core::kCovTd)));
  EXPECT_NEAR(core::to_seconds(at_zero.states[1].t_ns - s.measurements.frames.front().t_cam_ns), 0.0, 2.6e-3);
  EXPECT_NEAR(core::to_seconds(at_td.states[1].t_ns - s.measurements.frames.front().t_cam_ns), 0.02, 7.6e-3);
}

TEST(Batch, BothSolversAgree) {
  const auto s = sim::simulate(scenario(), {1, 0});
  estimator::EstimatorConfig config;
  config.solver = estimator::Solver::kSchur;
  const core::EstimateLog schur = estimator::estimate(s.measurements, config);
  config.solver = estimator::Solver::kCeres;
  const core::EstimateLog ceres = estimator::estimate(s.measurements, config);
  // Both end after a step of a thousandth of a sigma, of all unknowns together: 0.1 us of td.
  EXPECT_NEAR(schur.calibration.td_s, ceres.calibration.td_s, 1e-7);
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

// Whatever leaves two states at one IMU sample: the reason names the keyframe.
TEST(Batch, StatesWithoutMotionBetweenThemAreAFailedInitialisation) {
  const auto s = sim::simulate(scenario(), {1, 0});
  const auto reason = [](const core::MeasurementLog& log, const estimator::EstimatorConfig& config) {
    const core::EstimateLog estimate = estimator::estimate(log, config);
    EXPECT_EQ(estimate.status, core::SolveStatus::kFailedInitialisation);
    EXPECT_TRUE(estimate.states.empty());
    return estimate.reason;
  };
  core::MeasurementLog cut_short = s.measurements;
  cut_short.imu.resize(cut_short.imu.size() / 2);
  EXPECT_NE(reason(cut_short, {}).find("keyframe 2"), std::string::npos);
  core::MeasurementLog early = s.measurements;
  early.prior.start_calibration.td_s = -0.4;
  EXPECT_NE(reason(early, {}).find("keyframe 0"), std::string::npos);
  estimator::EstimatorConfig far;
  far.state_td_s = 6.0;
  EXPECT_NE(reason(s.measurements, far).find("keyframe 1"), std::string::npos);
  core::MeasurementLog late_prior = s.measurements;
  late_prior.prior.t_ns = late_prior.imu[late_prior.imu.size() / 2].t_ns;
  EXPECT_NE(reason(late_prior, {}).find("keyframe 0"), std::string::npos);

  sim::ScenarioConfig slow = scenario();
  slow.imu.rate_hz = 12.0;
  estimator::EstimatorConfig fast;
  fast.keyframe_rate_hz = 20.0;
  EXPECT_NE(reason(sim::simulate(slow, {1, 0}).measurements, fast).find("keyframe"), std::string::npos);
}

// The IMU alone is no answer, however well its residuals fit.
TEST(Batch, NoObservationIsAFailedInitialisation) {
  auto s = sim::simulate(scenario(), {1, 0});
  for (core::Frame& frame : s.measurements.frames) frame.points.clear();
  const core::EstimateLog estimate = estimator::estimate(s.measurements, {});
  EXPECT_EQ(estimate.status, core::SolveStatus::kFailedInitialisation);
  EXPECT_EQ(estimate.reason, "no observation could be used");
}

// Ceres has not one iteration to tell of where the first evaluation fails.
TEST(Batch, AStartThatCannotBeEvaluatedIsAStatus) {
  auto s = sim::simulate(scenario(), {1, 0});
  s.measurements.prior.start.v_W.x() = std::numeric_limits<double>::infinity();
  const core::EstimateLog estimate = estimator::estimate(s.measurements, {});
  EXPECT_EQ(estimate.status, core::SolveStatus::kFailedInitialisation);
  EXPECT_FALSE(estimate.reason.empty());
  EXPECT_EQ(estimate.summary.iterations, 0);
}

TEST(Batch, RefusesNoiseAndPriorsWithoutWidth) {
  const auto noise_free = sim::simulate(testing::noise_free(scenario(), 200.0), {1, 0});
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

// Zero for a velocity that is not known would be a wrong one.
TEST(Keyframes, ObservationsWithoutVelocityAreLeftOut) {
  const Eigen::Vector2d v(0.1, 0.2);
  std::vector<estimator::Track> tracks = {
      {.id = 1, .observations = {{0, {1, 1}}, {1, {1, 1}, v}, {2, {1, 1}, v}}},
      {.id = 2, .observations = {{0, {1, 1}}, {1, {1, 1}, v}}},
  };
  EXPECT_EQ(estimator::drop_without_velocity(tracks), 2);
  ASSERT_EQ(tracks.size(), 1U);
  EXPECT_EQ(tracks.front().id, 1);
  EXPECT_EQ(tracks.front().observations.front().keyframe, 1U);  // the anchor is the first that has one
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
