// The batch estimator on segments: the model's own error, conventions, what may be free, and what is left out.
#include <cmath>
#include <limits>
#include <string>

#include <gtest/gtest.h>

#include "core/error.h"
#include "estimator/estimate.h"
#include "estimator/keyframes.h"
#include "short_recording.h"
#include "simulated_lines.h"

namespace plumbline {
namespace {

using estimator::ObservationUse;
using testing::errors_of;
using testing::SimulatedLines;

sim::ScenarioConfig scenario() { return testing::short_scenario(20); }

estimator::EstimatorConfig config_for(ObservationUse use) {
  estimator::EstimatorConfig c;
  c.use = use;
  return c;
}

estimator::EstimatorConfig believing_euroc(ObservationUse use) {
  estimator::EstimatorConfig c = testing::believing(testing::kEurocLike, 1.0);
  c.use = use;
  return c;
}

double sigma(const core::EstimateLog& estimate, int i) { return std::sqrt(estimate.covariance(i, i)); }

// Without noise all that is left is the midpoint rule: second order, so a quarter from each rate to the next.
TEST(LineBatch, NoiseFreeErrorIsTheIntegratorsAndFallsWithItsOrder) {
  double last_td_s = 0.0;
  double last_position_m = 0.0;
  for (const double rate : {200.0, 400.0, 800.0}) {
    const auto s = testing::simulate_with_lines(testing::noise_free(scenario(), rate), {1, 0}, {.sigma_px = 0.0});
    const core::EstimateLog estimate = estimator::estimate(s.measurements, believing_euroc(ObservationUse::kLines));
    ASSERT_EQ(estimate.status, core::SolveStatus::kConverged) << estimate.reason;
    EXPECT_GT(estimate.lines.size(), 20U);
    const double td_s = errors_of(estimate, s.truth).td_s;
    const double position_m = errors_of(estimate, s.truth).position_rms_m;
    if (rate == 200.0) {
      EXPECT_LT(std::abs(td_s), 1e-6);
      EXPECT_LT(position_m, 1e-3);
    } else {
      EXPECT_NEAR(last_td_s / td_s, 4.0, 0.6);
      EXPECT_NEAR(last_position_m / position_m, 4.0, 0.6);
    }
    last_td_s = td_s;
    last_position_m = position_m;
  }
}

TEST(LineBatch, EachUseRecoversTdReadoutAndExtrinsics) {
  const auto s = testing::simulate_with_lines(scenario(), {1, 0}, {});
  core::EstimateLog estimates[3];
  for (int use = 0; use < 3; ++use) {
    core::EstimateLog& estimate = estimates[use];
    estimate = estimator::estimate(s.measurements, config_for(static_cast<ObservationUse>(use)));
    ASSERT_EQ(estimate.status, core::SolveStatus::kConverged) << use << ": " << estimate.reason;
    // 4.5 sigma: 7 in a million a quantity.
    EXPECT_LT(std::abs(errors_of(estimate, s.truth).td_s), 4.5 * sigma(estimate, core::kCovTd)) << use;
    EXPECT_LT(std::abs(estimate.calibration.readout_s - s.truth.calibration.readout_s),
              4.5 * sigma(estimate, core::kCovReadout))
        << use;
    const Eigen::Vector3d e = estimate.calibration.T_B_C.p - s.truth.calibration.T_B_C.p;
    for (int i = 0; i < 3; ++i) EXPECT_LT(std::abs(e[i]), 4.5 * sigma(estimate, i)) << use;
    // The prior's were 20 ms and 5 ms.
    EXPECT_LT(sigma(estimate, core::kCovTd), 0.5e-3) << use;
    EXPECT_LT(sigma(estimate, core::kCovReadout), 1.5e-3) << use;
    // Thousands of degrees of freedom: 5 sigma.
    const int dof = estimate.summary.residuals - estimate.summary.parameters;
    EXPECT_NEAR(estimate.summary.cost_per_dof(), 1.0, 5.0 * std::sqrt(2.0 / dof)) << use;
  }
  const auto& [both, points, lines] = estimates;
  // More measurements, less variance.
  for (int i = 0; i < core::kCovIntrinsics; ++i) {
    EXPECT_LT(both.covariance(i, i), points.covariance(i, i)) << i;
    EXPECT_LT(both.covariance(i, i), lines.covariance(i, i)) << i;
  }
  EXPECT_TRUE(points.lines.empty());
  EXPECT_EQ(points.line_tracks, 0);
  EXPECT_EQ(both.line_tracks, lines.line_tracks);
  EXPECT_EQ(both.summary.visual.residuals, 2 * both.summary.observations);
}

// All rows at once: the readout says nothing, and lines alone are enough.
TEST(LineBatch, GlobalShutter) {
  sim::ScenarioConfig c = scenario();
  c.camera.readout_s = 0.0;
  for (const std::uint64_t trial : {0, 1}) {
    const auto s = testing::simulate_with_lines(c, {1, trial}, {});
    const core::EstimateLog estimate = estimator::estimate(s.measurements, config_for(ObservationUse::kLines));
    ASSERT_EQ(estimate.status, core::SolveStatus::kConverged) << trial << ": " << estimate.reason;
    EXPECT_LT(std::abs(errors_of(estimate, s.truth).td_s), 4.5 * sigma(estimate, core::kCovTd)) << trial;
  }
}

// A recording without lines is the same to the bit, whether lines are asked for or not.
TEST(LineBatch, PointsAloneAreWhatTheyWere) {
  const auto s = sim::simulate(scenario(), {1, 0});
  const core::EstimateLog both = estimator::estimate(s.measurements, config_for(ObservationUse::kPointsAndLines));
  const core::EstimateLog points = estimator::estimate(s.measurements, config_for(ObservationUse::kPoints));
  EXPECT_EQ(both.covariance, points.covariance);
  EXPECT_EQ(both.calibration.td_s, points.calibration.td_s);
  EXPECT_EQ(both.summary.final_cost, points.summary.final_cost);
  const core::EstimateLog lines = estimator::estimate(s.measurements, config_for(ObservationUse::kLines));
  EXPECT_EQ(lines.status, core::SolveStatus::kFailedInitialisation);
  EXPECT_EQ(lines.reason, "no observation could be used");
}

// Exact velocities and light noise: the model neglects accelerations in the picture, and is good to a millisecond.
TEST(LineBatch, FeatureVelocityFindsTd) {
  sim::ScenarioConfig c = scenario();
  for (const double readout_s : {0.0, 0.03}) {
    c.camera.readout_s = readout_s;
    const auto s = testing::simulate_with_lines(c, {1, 0}, {.sigma_px = 0.2});
    estimator::EstimatorConfig config = config_for(ObservationUse::kLines);
    config.timing = estimator::TimingModel::kFeatureVelocity;
    config.max_cost_per_dof = 10.0;
    const core::EstimateLog estimate = estimator::estimate(s.measurements, config);
    ASSERT_EQ(estimate.status, core::SolveStatus::kConverged) << estimate.reason;
    EXPECT_LT(std::abs(errors_of(estimate, s.truth).td_s), 1.5e-3) << readout_s;
  }
}

TEST(LineBatch, FeatureVelocityNeedsVelocities) {
  auto s = testing::simulate_with_lines(scenario(), {1, 0}, {});
  for (core::Frame& frame : s.measurements.frames) {
    for (core::LineObservation& line : frame.lines) line.velocities.reset();
  }
  estimator::EstimatorConfig config = config_for(ObservationUse::kLines);
  config.timing = estimator::TimingModel::kFeatureVelocity;
  const core::EstimateLog estimate = estimator::estimate(s.measurements, config);
  EXPECT_EQ(estimate.status, core::SolveStatus::kFailedInitialisation);
  EXPECT_NE(estimate.reason.find("velocities"), std::string::npos);
}

// Which end is which is no part of the model.
TEST(LineBatch, TheOrderOfTheEndsSaysNothing) {
  const auto s = testing::simulate_with_lines(scenario(), {1, 0}, {});
  core::MeasurementLog swapped = s.measurements;
  const core::RandomStream coin({1, 0}, "line_batch_test/coin");
  for (std::size_t k = 0; k < swapped.frames.size(); ++k) {
    for (core::LineObservation& line : swapped.frames[k].lines) {
      if (coin.uniform(k, static_cast<std::uint64_t>(line.track_id)) < 0.5) continue;
      std::swap(line.ends_px[0], line.ends_px[1]);
      std::swap((*line.velocities)[0], (*line.velocities)[1]);
    }
  }
  const estimator::EstimatorConfig config = config_for(ObservationUse::kLines);
  const core::EstimateLog a = estimator::estimate(s.measurements, config);
  const core::EstimateLog b = estimator::estimate(swapped, config);
  ASSERT_EQ(a.status, core::SolveStatus::kConverged);
  ASSERT_EQ(b.status, core::SolveStatus::kConverged);
  // Both stop within 1e-9 of the minimal cost: a thousandth of a sigma.
  EXPECT_NEAR(a.calibration.td_s, b.calibration.td_s, 2e-3 * sigma(a, core::kCovTd));
  ASSERT_EQ(a.lines.size(), b.lines.size());
}

// t_imu = t_cam + td: stamping the camera delta earlier and adding delta to td and its prior changes nothing.
TEST(LineBatch, ShiftingTheCameraClockShiftsTdOnly) {
  const auto s = testing::simulate_with_lines(scenario(), {1, 3}, {});
  const core::TimeNs delta_ns = 7'000'000;
  core::MeasurementLog shifted = s.measurements;
  for (core::Frame& frame : shifted.frames) frame.t_cam_ns -= delta_ns;
  shifted.prior.calibration.td_s += core::to_seconds(delta_ns);
  shifted.prior.start_calibration.td_s += core::to_seconds(delta_ns);
  const core::EstimateLog a = estimator::estimate(s.measurements, config_for(ObservationUse::kLines));
  const core::EstimateLog b = estimator::estimate(shifted, config_for(ObservationUse::kLines));
  ASSERT_EQ(a.status, core::SolveStatus::kConverged);
  ASSERT_EQ(b.status, core::SolveStatus::kConverged);
  EXPECT_NEAR(b.calibration.td_s - a.calibration.td_s, core::to_seconds(delta_ns), 1e-8);
}

// Lines of the estimate are in the world, through the true segments.
TEST(LineBatch, LinesAreThoseOfTheWorld) {
  const auto s = testing::simulate_with_lines(testing::noise_free(scenario(), 400.0), {1, 0}, {.sigma_px = 0.0});
  const core::EstimateLog estimate = estimator::estimate(s.measurements, believing_euroc(ObservationUse::kLines));
  ASSERT_EQ(estimate.status, core::SolveStatus::kConverged) << estimate.reason;
  EXPECT_GT(static_cast<double>(estimate.lines.size()), 0.6 * estimate.line_tracks);
  for (const core::LineEstimate& line : estimate.lines) {
    EXPECT_NEAR(line.direction_W.norm(), 1.0, 1e-12);
    EXPECT_NEAR(line.direction_W.dot(line.moment_W), 0.0, 1e-9);
    const sim::Segment& segment = s.truth.segments_W[static_cast<std::size_t>(s.truth.track_segment.at(line.track_id))];
    // The distance of P from the line is |P x d - n|. Weak parallax magnifies the integrator's error of 0.1 mm.
    for (const Eigen::Vector3d& P : segment.ends_W) {
      EXPECT_LT((P.cross(line.direction_W) - line.moment_W).norm(), 5e-3) << line.track_id;
    }
  }
}

// One observation in fifty carries another line's track.
sim::Simulation with_wrong_matches() {
  auto s = testing::simulate_with_lines(scenario(), {1, 0}, {});
  const core::RandomStream coin({1, 0}, "line_batch_test/wrong_match");
  for (std::size_t k = 0; k < s.measurements.frames.size(); ++k) {
    auto& lines = s.measurements.frames[k].lines;
    for (std::size_t i = 0; i + 1 < lines.size(); i += 2) {
      if (coin.uniform(k, i) < 0.02) std::swap(lines[i].track_id, lines[i + 1].track_id);
    }
  }
  return s;
}

TEST(LineBatch, WrongMatchesAreCulled) {
  const auto s = with_wrong_matches();
  estimator::EstimatorConfig config;
  config.loss = estimator::RobustLoss::kCauchy;
  const core::EstimateLog estimate = estimator::estimate(s.measurements, config);
  ASSERT_EQ(estimate.status, core::SolveStatus::kConverged) << estimate.reason;
  EXPECT_LT(std::abs(errors_of(estimate, s.truth).td_s), 4.5 * sigma(estimate, core::kCovTd));
  EXPECT_LT(static_cast<int>(estimate.lines.size()), estimate.line_tracks);
  // What is left has no residual beyond the limit; kept, they would have had hundreds of sigmas.
  config.lines.cull_sigma = 1e6;
  config.max_iterations = 10;
  const core::EstimateLog kept = estimator::estimate(s.measurements, config);
  EXPECT_GT(kept.lines.size(), estimate.lines.size());
  EXPECT_GT(kept.summary.visual.squares / kept.summary.visual.residuals, 3.0);
  EXPECT_LT(estimate.summary.visual.squares / estimate.summary.visual.residuals, 1.2);
}

// Without outliers a wide loss changes nothing, and a narrow one the cost only a little.
TEST(LineBatch, AWideLossIsNone) {
  const auto s = testing::simulate_with_lines(scenario(), {1, 0}, {});
  estimator::EstimatorConfig config;
  const core::EstimateLog none = estimator::estimate(s.measurements, config);
  config.loss = estimator::RobustLoss::kHuber;
  config.loss_scale = 100.0;
  const core::EstimateLog wide = estimator::estimate(s.measurements, config);
  // Ceres scales the residuals by a root that rounds: a thousandth of a sigma.
  EXPECT_NEAR(wide.calibration.td_s, none.calibration.td_s, 1e-3 * sigma(none, core::kCovTd));
  config.loss_scale = 1.0;
  const core::EstimateLog narrow = estimator::estimate(s.measurements, config);
  ASSERT_EQ(narrow.status, core::SolveStatus::kConverged);
  EXPECT_LT(narrow.summary.final_cost, none.summary.final_cost);
  EXPECT_LT(std::abs(narrow.calibration.td_s - none.calibration.td_s), sigma(none, core::kCovTd));
  EXPECT_GT(sigma(narrow, core::kCovTd), sigma(none, core::kCovTd));
}

TEST(LineBatch, RefusesLinesWithoutNoise) {
  const auto s = testing::simulate_with_lines(scenario(), {1, 0}, {.sigma_px = 0.0});
  EXPECT_THROW(estimator::estimate(s.measurements, {}), core::ConfigError);
  EXPECT_NO_THROW(estimator::estimate(s.measurements, config_for(ObservationUse::kPoints)));
  core::MeasurementLog no_point_noise = s.measurements;
  no_point_noise.pixel_sigma_px = 0.0;
  no_point_noise.line_sigma_px = 1.0;
  EXPECT_THROW(estimator::estimate(no_point_noise, {}), core::ConfigError);
  EXPECT_NO_THROW(estimator::estimate(no_point_noise, config_for(ObservationUse::kLines)));
}

TEST(LineKeyframes, Tracks) {
  const core::LineObservation seen{.track_id = 5, .ends_px = {Eigen::Vector2d(1, 2), Eigen::Vector2d(30, 40)}};
  std::vector<core::Frame> frames;
  for (int i = 0; i < 6; ++i) {
    core::Frame frame{.t_cam_ns = core::to_ns(i / 20.0)};
    if (i != 0) frame.lines.push_back(seen);
    if (i == 2) frame.lines.push_back({.track_id = 6, .ends_px = seen.ends_px});
    frames.push_back(frame);
  }
  auto tracks = estimator::collect_line_tracks(frames, estimator::select_keyframes(frames, 10.0), {});
  ASSERT_EQ(tracks.size(), 1U);  // track 6 is in one keyframe only
  EXPECT_EQ(tracks.front().id, 5);
  ASSERT_EQ(tracks.front().observations.size(), 2U);
  EXPECT_EQ(tracks.front().observations.front().keyframe, 1U);
  EXPECT_EQ(tracks.front().observations.front().ends_px, seen.ends_px);
  EXPECT_EQ(estimator::drop_without_velocity(tracks), 2);
  EXPECT_TRUE(tracks.empty());
}

}  // namespace
}  // namespace plumbline
