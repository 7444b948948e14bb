// The Cramer-Rao bound of lines against the covariance that the batch estimator's own factors give at the truth.
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "bound_problem.h"
#include "eval/cramer_rao.h"
#include "simulated_lines.h"

namespace plumbline::eval {
namespace {

using estimator::ObservationUse;
using plumbline::testing::every_second_frame;
using plumbline::testing::true_states;

sim::ScenarioConfig scenario() { return plumbline::testing::bound_scenario(10); }

estimator::BatchValues true_values(const estimator::BatchInput& input, const sim::GroundTruth& truth) {
  estimator::BatchValues values = true_states(input, truth);
  for (const estimator::LineTrack& track : input.line_tracks) {
    const auto& ends = truth.segments_W[static_cast<std::size_t>(truth.track_segment.at(track.id))].ends_W;
    // Another origin than the bound's: covariances of the rest do not depend on it.
    const core::State& anchor = values.states[track.observations.front().keyframe + 1];
    const Eigen::Vector3d origin_W = anchor.T_W_B.p + Eigen::Vector3d(0.1, -0.2, 0.15);
    const auto block = estimator::orthonormal_line(estimator::line_through(ends[0] - origin_W, ends[1] - origin_W));
    values.lines.push_back(estimator::LineValue{origin_W, block.value()});
  }
  values.culled_lines.resize(input.line_tracks.size());
  return values;
}

// Each entry against the geometric mean of its diagonal ones.
void expect_same(const core::PosteriorCovariance& a, const core::PosteriorCovariance& b, double tolerance) {
  for (int r = 0; r < core::kCovDim; ++r) {
    for (int c = 0; c < core::kCovDim; ++c) {
      EXPECT_LE(std::abs(a(r, c) - b(r, c)), tolerance * std::sqrt(b(r, r) * b(c, c))) << r << " " << c;
    }
  }
}

class LineBound : public ::testing::Test {
 protected:
  static sim::Simulation simulate(const sim::ScenarioConfig& c, double sigma_px = 1.0) {
    sim::Simulation s = plumbline::testing::simulate_with_lines(c, {3, 0}, {.per_frame = 12, .sigma_px = sigma_px});
    s.measurements.imu = noise_free_imu(s.measurements, s.truth);  // what the bound linearises at
    return s;
  }
  static core::PosteriorCovariance brute_force(const sim::Simulation& s) {
    const core::MeasurementLog& log = s.measurements;
    estimator::EstimatorConfig config;
    config.use = ObservationUse::kLines;
    estimator::BatchInput input{
        .log = log,
        .config = config,
        .noise = estimator::believed_noise(config, log.imu_noise, log.pixel_sigma_px, log.line_sigma_px),
        .keyframes = every_second_frame(log),
        .tracks = {}};
    input.line_tracks = estimator::collect_line_tracks(log.frames, input.keyframes, log.camera);
    EXPECT_GT(input.line_tracks.size(), 10U);
    return *estimator::BatchProblem(input, true_values(input, s.truth)).covariance();
  }
  static CramerRaoBound bound(const sim::Simulation& s, BoundOptions options) {
    options.frames = every_second_frame(s.measurements);
    return cramer_rao_bound(s.measurements, s.truth, options);
  }
};

TEST_F(LineBound, IsWhatTheEstimatorsOwnFactorsGiveAtTheTruth) {
  const sim::Simulation s = simulate(scenario());
  expect_same(bound(s, {.frames = {}, .points = false}).covariance, brute_force(s), 1e-8);
}

TEST_F(LineBound, GlobalShutterToo) {
  sim::ScenarioConfig c = scenario();
  c.camera.readout_s = 0.0;
  const sim::Simulation s = simulate(c);
  expect_same(bound(s, {.frames = {}, .points = false}).covariance, brute_force(s), 1e-8);
}

// The noise of the ends across the line is no part of the bound; that along the line moves the places on it that are
// measured, by a share of the segment's length.
TEST_F(LineBound, DependsOnTheDrawOfTheNoiseLittle) {
  const sim::Simulation noisy = simulate(scenario());
  sim::Simulation exact = simulate(scenario(), 0.0);
  exact.measurements.line_sigma_px = noisy.measurements.line_sigma_px;
  const BoundOptions lines{.frames = {}, .points = false};
  const double a = bound(noisy, lines).covariance(core::kCovTd, core::kCovTd);
  const double b = bound(exact, lines).covariance(core::kCovTd, core::kCovTd);
  EXPECT_NEAR(a / b, 1.0, 0.02);
}

TEST_F(LineBound, IsOfWhatIsUsed) {
  const sim::Simulation s = simulate(scenario());
  const CramerRaoBound both = bound(s, {});
  const CramerRaoBound points = bound(s, {.frames = {}, .lines = false});
  const CramerRaoBound lines = bound(s, {.frames = {}, .points = false});
  for (int i = 0; i < core::kCovIntrinsics; ++i) {
    EXPECT_LT(both.covariance(i, i), points.covariance(i, i)) << i;
    EXPECT_LT(both.covariance(i, i), lines.covariance(i, i)) << i;
  }
  EXPECT_GT(points.kappa2, 0.0);
  EXPECT_GT(lines.kappa2, 0.0);
  EXPECT_NEAR(both.kappa2, points.kappa2 + lines.kappa2, 1e-12 * both.kappa2);

  sim::Simulation without = s;
  for (core::Frame& frame : without.measurements.frames) frame.lines.clear();
  EXPECT_EQ(bound(without, {}).covariance, points.covariance);
}

TEST_F(LineBound, CausalBoundFallsToTheFullOne) {
  const sim::Simulation s = simulate(scenario());
  const CramerRaoBound b = bound(s, {.frames = {}, .points = false, .causal = true});
  for (std::size_t k = 1; k < b.causal.size(); ++k) {
    EXPECT_LE(b.causal[k].covariance(core::kCovTd, core::kCovTd),
              b.causal[k - 1].covariance(core::kCovTd, core::kCovTd) * (1.0 + 1e-6));
  }
  // InformationChain::kWeak leaks in.
  expect_same(b.causal.back().covariance, b.covariance, 1e-5);
}

// At rest every line is seen in one plane: two of its four directions are observed, and nothing is said of td.
TEST_F(LineBound, RestLeavesThePriors) {
  sim::ScenarioConfig c = scenario();
  c.trajectory.type = sim::TrajectoryType::kStatic;
  const sim::Simulation s = simulate(c);
  const core::PosteriorCovariance P = bound(s, {.frames = {}, .points = false}).covariance;
  const core::CalibrationSigmas& prior = s.measurements.prior.calibration_sigma;
  EXPECT_NEAR(std::sqrt(P(core::kCovTd, core::kCovTd)), prior.td_s, 1e-3 * prior.td_s);
  EXPECT_NEAR(std::sqrt(P(core::kCovReadout, core::kCovReadout)), prior.readout_s, 1e-3 * prior.readout_s);
  EXPECT_NEAR(std::sqrt(P(0, 0)), prior.extrinsic_position_m, 1e-3 * prior.extrinsic_position_m);
}

TEST_F(LineBound, NeedsTheirNoise) {
  const sim::Simulation s = simulate(scenario(), 0.0);
  EXPECT_THROW(bound(s, {}), std::domain_error);
  EXPECT_NO_THROW(bound(s, {.frames = {}, .lines = false}));
}

}  // namespace
}  // namespace plumbline::eval
