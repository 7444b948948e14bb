// The online estimator on simulated recordings: its own error, consistency, how far off it may start, what it refuses.
#include <cmath>
#include <cstdint>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "core/random.h"
#include "estimator/estimate.h"
#include "nees_over_trials.h"
#include "short_recording.h"
#include "sim/simulate.h"

namespace plumbline {
namespace {

using testing::Errors;
using testing::errors_of;

estimator::EstimatorConfig online() {
  estimator::EstimatorConfig config;
  config.type = estimator::EstimatorType::kSlidingWindow;
  return config;
}

sim::ScenarioConfig scenario() { return testing::short_scenario(40); }

double sigma_of(const core::EstimateLog& estimate, int i) { return std::sqrt(estimate.covariance(i, i)); }

// Without noise all that is left is the midpoint rule: second order, so a quarter from each rate to the next.
TEST(SlidingWindow, NoiseFreeErrorIsTheIntegratorsAndFallsWithItsOrder) {
  estimator::EstimatorConfig config = testing::believing(testing::kEurocLike, 1.0);
  config.type = estimator::EstimatorType::kSlidingWindow;
  config.window.largest_depth_sigma = 1e6;  // what it believes of depths before parallax tells them is not the truth
  double last_td_s = 0.0;
  for (const double rate : {200.0, 400.0}) {
    const auto s = sim::simulate(testing::noise_free(scenario(), rate), {1, 0});
    const core::EstimateLog estimate = estimator::estimate(s.measurements, config);
    ASSERT_EQ(estimate.status, core::SolveStatus::kConverged) << estimate.reason;
    const Errors e = errors_of(estimate, s.truth);
    const core::StampedState& last = estimate.states.back();
    const double final_m = (last.state.T_W_B.p - sim::state_at(s.truth, last.t_ns).T_W_B.p).norm();
    if (rate == 200.0) {
      EXPECT_LT(std::abs(e.td_s), 1e-6);
      EXPECT_LT(final_m, 1e-3);
    } else {
      EXPECT_NEAR(last_td_s / e.td_s, 4.0, 1.0);
    }
    last_td_s = e.td_s;
  }
}

testing::NeesOverTrials forty_trials(const sim::ScenarioConfig& c, const estimator::EstimatorConfig& config) {
  testing::NeesOverTrials trials;
  for (std::uint64_t trial = 0; trial < 40; ++trial) {
    const auto s = sim::simulate(c, {2, trial});
    const core::EstimateLog estimate = estimator::estimate(s.measurements, config);
    EXPECT_EQ(estimate.status, core::SolveStatus::kConverged) << trial << ": " << estimate.reason;
    EXPECT_EQ(estimate.states.size(), estimate.state_history.size());
    EXPECT_EQ(estimate.td_history.size(), estimate.state_history.size());
    trials.add(estimate, s.truth);
  }
  return trials;
}

TEST(SlidingWindow, NeesIsInsideItsBand) {
#ifdef PLUMBLINE_SANITIZED
  GTEST_SKIP() << "forty times what the other tests do";
#endif
  const testing::NeesOverTrials trials = forty_trials(scenario(), online());
  trials.expect_inside_bands();
  trials.expect_scaled_outside({"td_error_s", "calibration", "final_pose", "final_velocity", "final_bias", "joint"});
}

// Which noise there is, and what is known. The estimator believes in both noises throughout.
TEST(SlidingWindow, EachNoiseAloneIsLessThanBoth) {
  const auto last_error = [](const core::EstimateLog& estimate, const sim::GroundTruth& truth) {
    const core::StampedState& last = estimate.states.back();
    const core::StateTangent d = core::minus(last.state, sim::state_at(truth, last.t_ns));
    const auto P =
        estimate.covariance.block<core::kStateDof, core::kStateDof>(core::kCovLastState, core::kCovLastState);
    return d.dot(P.ldlt().solve(d));
  };
  // Chi-square of 15: 1e-5 above.
  constexpr double kMost = 50.5;
  estimator::EstimatorConfig config = testing::believing(testing::kEurocLike, 1.0);
  config.type = estimator::EstimatorType::kSlidingWindow;

  sim::ScenarioConfig pixels = scenario();
  pixels.imu.noise = {};
  const auto in_pixels = sim::simulate(pixels, {1, 10});
  const core::EstimateLog from_pixels = estimator::estimate(in_pixels.measurements, config);
  ASSERT_EQ(from_pixels.status, core::SolveStatus::kConverged) << from_pixels.reason;
  EXPECT_LT(last_error(from_pixels, in_pixels.truth), kMost);
  EXPECT_LT(std::abs(errors_of(from_pixels, in_pixels.truth).td_s), 4.5 * sigma_of(from_pixels, core::kCovTd));

  // td is told by the pixels: without their noise, and with the prior's means at the truth, it is known far better than
  // the estimator can believe.
  sim::ScenarioConfig imu = scenario();
  imu.camera.pixel_sigma_px = 0.0;
  imu.prior.means = sim::PriorMeans::kTruth;
  imu.prior.start = sim::PriorStart::kDrawn;
  const auto in_imu = sim::simulate(imu, {1, 11});
  const core::EstimateLog from_imu = estimator::estimate(in_imu.measurements, config);
  ASSERT_EQ(from_imu.status, core::SolveStatus::kConverged) << from_imu.reason;
  EXPECT_LT(last_error(from_imu, in_imu.truth), kMost);
  EXPECT_LT(std::abs(errors_of(from_imu, in_imu.truth).td_s), 0.5 * sigma_of(from_imu, core::kCovTd));
}

TEST(SlidingWindow, WhatIsKnownStaysAsItIs) {
  sim::ScenarioConfig c = scenario();
  c.prior.td_mean_s = c.camera.td_s;
  c.prior.readout_mean_s = c.camera.readout_s;
  const auto s = sim::simulate(c, {1, 12});
  estimator::EstimatorConfig config = online();
  const core::EstimateLog free = estimator::estimate(s.measurements, config);
  config.estimate.td = false;
  config.estimate.readout = false;
  const core::EstimateLog held = estimator::estimate(s.measurements, config);
  ASSERT_EQ(free.status, core::SolveStatus::kConverged) << free.reason;
  ASSERT_EQ(held.status, core::SolveStatus::kConverged) << held.reason;
  EXPECT_EQ(held.calibration.td_s, s.truth.calibration.td_s);
  EXPECT_EQ(held.calibration.readout_s, s.truth.calibration.readout_s);
  EXPECT_EQ(sigma_of(held, core::kCovTd), 0.0);
  EXPECT_TRUE(held.td_history.empty());
  // Who knows more is less unsure, but for what the two linearise about.
  for (int i = core::kCovLastState; i < core::kCovIntrinsics; ++i)
    EXPECT_LE(sigma_of(held, i), 1.02 * sigma_of(free, i)) << i;
}

sim::ScenarioConfig unsure_camera(sim::ScenarioConfig c) {
  c.prior.focal_sigma_px = 5.0;
  c.prior.principal_point_sigma_px = 5.0;
  return c;
}

// With a rolling shutter the camera's numbers move the time of a sight, too.
TEST(SlidingWindow, NoiseFreeItFindsTheCamera) {
  estimator::EstimatorConfig config = testing::believing(testing::kEurocLike, 1.0);
  config.type = estimator::EstimatorType::kSlidingWindow;
  config.window.largest_depth_sigma = 1e6;
  config.estimate.intrinsics = true;
  const auto s = sim::simulate(unsure_camera(testing::noise_free(scenario(), 400.0)), {1, 0});
  const core::Intrinsics truth = *s.truth.calibration.intrinsics;
  EXPECT_GT((*s.measurements.prior.start_calibration.intrinsics - truth).cwiseAbs().minCoeff(), 0.3);
  const core::EstimateLog estimate = estimator::estimate(s.measurements, config);
  ASSERT_EQ(estimate.status, core::SolveStatus::kConverged) << estimate.reason;
  const Errors e = errors_of(estimate, s.truth);
  EXPECT_LT(std::abs(e.td_s), 1e-6);
  EXPECT_LT(std::abs(e.readout_s), 2e-6);
  EXPECT_LT(e.extrinsic_m, 1e-3);
  EXPECT_LT((*estimate.calibration.intrinsics - truth).norm(), 0.05);
}

TEST(SlidingWindow, NeesWithTheCameraIsInsideItsBand) {
#ifdef PLUMBLINE_SANITIZED
  GTEST_SKIP() << "forty times what the other tests do";
#endif
  estimator::EstimatorConfig config = online();
  config.estimate.intrinsics = true;
  const testing::NeesOverTrials trials = forty_trials(unsure_camera(scenario()), config);
  trials.expect_inside_bands(core::kCovDim);
  trials.expect_scaled_outside({"intrinsics", "calibration", "joint"});
}

// A prior three times as wide: what leaves first, linearised at a camera that is yet little known, does not hold it
// there.
TEST(SlidingWindow, FindsTheCameraFromFarOff) {
  estimator::EstimatorConfig config = online();
  config.estimate.intrinsics = true;
  sim::ScenarioConfig c = scenario();
  c.prior.focal_sigma_px = c.prior.principal_point_sigma_px = 15.0;
  for (std::uint64_t trial = 0; trial < 4; ++trial) {
    const auto s = sim::simulate(c, {4, trial});
    const core::EstimateLog estimate = estimator::estimate(s.measurements, config);
    ASSERT_EQ(estimate.status, core::SolveStatus::kConverged) << trial << ": " << estimate.reason;
    const core::Intrinsics e = *estimate.calibration.intrinsics - *s.truth.calibration.intrinsics;
    for (int i = 0; i < 4; ++i) {
      const double sigma_px = sigma_of(estimate, core::kCovIntrinsics + i);
      EXPECT_LT(sigma_px, 1.5);
      EXPECT_LT(std::abs(e[i]), 4.5 * sigma_px) << trial << " " << i;
    }
  }
}

TEST(SlidingWindow, TheCameraIsRefusedWhereItsDerivativesAreMissing) {
  const auto s = sim::simulate(unsure_camera(scenario()), {1, 10});
  const auto refusal = [&](const core::MeasurementLog& log, const auto& change) {
    estimator::EstimatorConfig config = online();
    config.estimate.intrinsics = true;
    change(config);
    try {
      estimator::estimate(log, config);
    } catch (const core::RuleError& error) {
      return error.violation.key;
    }
    return std::string("accepted");
  };
  const std::string key = "estimator.estimate.intrinsics";
  using Config = estimator::EstimatorConfig;
  EXPECT_EQ(refusal(s.measurements, [](Config& c) { c.type = estimator::EstimatorType::kBatch; }), key);
  EXPECT_EQ(refusal(s.measurements, [](Config& c) { c.timing = estimator::TimingModel::kFeatureVelocity; }), key);
  EXPECT_EQ(refusal(s.measurements, [](Config& c) { c.residual = estimator::ResidualType::kUnitSphere; }), key);
  EXPECT_EQ(refusal(s.measurements, [](Config& c) { c.landmark = estimator::LandmarkType::kFixedBearing; }), key);
  EXPECT_EQ(refusal(s.measurements, [](Config& c) { c.use = estimator::ObservationUse::kLines; }), key);
  core::MeasurementLog lines = s.measurements;
  lines.frames.front().lines.emplace_back();
  lines.line_sigma_px = 1.0;
  EXPECT_EQ(refusal(lines, [](Config&) {}), key);
  const auto known = sim::simulate(scenario(), {1, 10});
  EXPECT_EQ(refusal(known.measurements, [](Config&) {}), "scenario.prior.focal_sigma_px");
}

// The prior's mean is 0 whatever td is; five sigma, in which a trial may fail, but not with an answer that is wrong.
TEST(SlidingWindow, FindsTdFromFarOff) {
  for (const double td_s : {-0.05, 0.05, -0.15, 0.15}) {
    sim::ScenarioConfig c = scenario();
    c.camera.td_s = td_s;
    c.prior.td_mean_s = 0.0;
    c.prior.td_sigma_s = 0.03;
    const auto s = sim::simulate(c, {1, 4});
    const core::EstimateLog estimate = estimator::estimate(s.measurements, online());
    if (std::abs(td_s) < 0.1) {
      EXPECT_EQ(estimate.status, core::SolveStatus::kConverged) << td_s << ": " << estimate.reason;
    }
    if (estimate.status != core::SolveStatus::kConverged) {
      EXPECT_FALSE(estimate.reason.empty());
      continue;
    }
    // 4.5 sigma: 7 in a million.
    EXPECT_LT(std::abs(errors_of(estimate, s.truth).td_s), 4.5 * sigma_of(estimate, core::kCovTd)) << td_s;
    EXPECT_LT(sigma_of(estimate, core::kCovTd), 0.5e-3);
  }
}

TEST(SlidingWindow, TheSolversGiveTheSameAnswer) {
  const auto s = sim::simulate(scenario(), {1, 5});
  estimator::EstimatorConfig config = online();
  const core::EstimateLog schur = estimator::estimate(s.measurements, config);
  const core::EstimateLog again = estimator::estimate(s.measurements, config);
  config.solver = estimator::Solver::kCeres;
  const core::EstimateLog ceres = estimator::estimate(s.measurements, config);
  ASSERT_EQ(schur.status, core::SolveStatus::kConverged);
  ASSERT_EQ(ceres.status, core::SolveStatus::kConverged);
  EXPECT_EQ(schur.calibration.td_s, again.calibration.td_s);
  EXPECT_EQ(schur.covariance, again.covariance);
  // Both end within a fraction of a standard deviation of the minimum, each at its own place.
  EXPECT_LT(std::abs(schur.calibration.td_s - ceres.calibration.td_s), 0.2 * sigma_of(schur, core::kCovTd));
  EXPECT_NEAR(sigma_of(schur, core::kCovTd) / sigma_of(ceres, core::kCovTd), 1.0, 0.05);
}

TEST(SlidingWindow, WrongMatchesAreTakenOut) {
  sim::ScenarioConfig c = scenario();
  c.camera.gross_outlier_probability = 0.03;
  const auto s = sim::simulate(c, {1, 6});
  const core::EstimateLog robust = estimator::estimate(s.measurements, online());
  ASSERT_EQ(robust.status, core::SolveStatus::kConverged) << robust.reason;
  EXPECT_LT(std::abs(errors_of(robust, s.truth).td_s), 4.5 * sigma_of(robust, core::kCovTd));
  // All of them believed: wrong, and it says so.
  estimator::EstimatorConfig config = online();
  config.window.outlier_sigma = 1e6;
  const core::EstimateLog misled = estimator::estimate(s.measurements, config);
  EXPECT_NE(misled.status, core::SolveStatus::kConverged);
  EXPECT_FALSE(misled.reason.empty());
}

// A td that is held 60 ms off leaves no pose that fits: a failure with its cause, not an answer.
TEST(SlidingWindow, AWrongModelEndsAsANamedFailure) {
  sim::ScenarioConfig c = scenario();
  c.camera.td_s = 0.06;
  c.prior.td_mean_s = 0.0;
  const auto s = sim::simulate(c, {1, 7});
  estimator::EstimatorConfig config = online();
  config.estimate.td = false;
  const core::EstimateLog estimate = estimator::estimate(s.measurements, config);
  EXPECT_EQ(estimate.status, core::SolveStatus::kFalseMinimum);
  EXPECT_THAT(estimate.reason, ::testing::HasSubstr("keyframes in a row"));
}

// For 1.5 s every match is wrong: that ends the estimate, or it begins anew from the last state that fitted and says
// so.
TEST(SlidingWindow, BeginsAnewAfterAFailureWhereItMay) {
  auto s = sim::simulate(scenario(), {1, 13});
  const core::TimeNs first_ns = s.measurements.frames.front().t_cam_ns;
  const core::RandomStream random({1, 13}, "sliding_window_test");
  for (core::Frame& frame : s.measurements.frames) {
    const double t_s = core::to_seconds(frame.t_cam_ns - first_ns);
    if (t_s < 2.0 || t_s > 3.5) continue;
    for (core::PointObservation& o : frame.points) {
      const auto at =
          random.uniforms(static_cast<std::uint64_t>(frame.t_cam_ns), static_cast<std::uint64_t>(o.track_id));
      o.pixel = Eigen::Vector2d(at[0] * s.measurements.camera.width_px, at[1] * s.measurements.camera.height_px);
    }
  }
  estimator::EstimatorConfig config = online();
  const core::EstimateLog ended = estimator::estimate(s.measurements, config);
  EXPECT_NE(ended.status, core::SolveStatus::kConverged);
  EXPECT_FALSE(ended.reason.empty());
  EXPECT_FALSE(ended.restarts.has_value());
  config.window.restarts = 3;
  const core::EstimateLog again = estimator::estimate(s.measurements, config);
  ASSERT_EQ(again.status, core::SolveStatus::kConverged) << again.reason;
  EXPECT_GE(again.restarts.value(), 1);
  const core::StampedState& last = again.states.back();
  const core::StateTangent d = core::minus(last.state, sim::state_at(s.truth, last.t_ns));
  for (int i = 0; i < 3; ++i) EXPECT_LT(std::abs(d[i]), 4.5 * sigma_of(again, core::kCovLastState + i)) << i;
  EXPECT_LT(std::abs(errors_of(again, s.truth).td_s), 4.5 * sigma_of(again, core::kCovTd));
}

TEST(SlidingWindow, LinesHelpOnline) {
  sim::ScenarioConfig c = scenario();
  c.world.type = sim::WorldType::kRooms;
  c.points.per_frame = 8;
  c.world.lines.random = 800;
  c.lines.per_frame = 25;
  const auto s = sim::simulate(c, {1, 8});
  estimator::EstimatorConfig config = online();
  config.window.start_keyframes = config.window.keyframes;  // else the worse one is a batch for longer
  const core::EstimateLog both = estimator::estimate(s.measurements, config);
  config.use = estimator::ObservationUse::kPoints;
  const core::EstimateLog points = estimator::estimate(s.measurements, config);
  ASSERT_EQ(both.status, core::SolveStatus::kConverged) << both.reason;
  ASSERT_EQ(points.status, core::SolveStatus::kConverged) << points.reason;
  EXPECT_LT(std::abs(errors_of(both, s.truth).td_s), 4.5 * sigma_of(both, core::kCovTd));
  EXPECT_LT(sigma_of(both, core::kCovTd), 0.9 * sigma_of(points, core::kCovTd));
  EXPECT_GT(both.summary.observations, points.summary.observations + 50);
}

TEST(SlidingWindow, EveryModelOfTheFactorLibraryRuns) {
  sim::ScenarioConfig c = scenario();
  c.points.velocity_source = sim::VelocitySource::kExact;
  const auto s = sim::simulate(c, {1, 9});
  for (const auto timing : {estimator::TimingModel::kPropagated, estimator::TimingModel::kFeatureVelocity}) {
    for (const auto residual : {estimator::ResidualType::kPinhole, estimator::ResidualType::kUnitSphere}) {
      for (const auto landmark :
           {estimator::LandmarkType::kBearingInverseDepth, estimator::LandmarkType::kFixedBearing}) {
        estimator::EstimatorConfig config = online();
        config.timing = timing;
        config.residual = residual;
        config.landmark = landmark;
        config.max_cost_per_dof = 10.0;  // the other models are approximations
        const core::EstimateLog estimate = estimator::estimate(s.measurements, config);
        ASSERT_EQ(estimate.status, core::SolveStatus::kConverged) << estimate.reason;
        EXPECT_LT(std::abs(errors_of(estimate, s.truth).td_s), 1.5e-3);
      }
    }
  }
}

}  // namespace
}  // namespace plumbline
