// What the estimator makes of lenses, irregular stamps and gaps, and that a recording on disk is as good as one in
// memory.
#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/dataset.h"
#include "estimator/estimate.h"
#include "sim/simulate.h"
#include "sim/truth_files.h"

namespace plumbline {
namespace {

namespace fs = std::filesystem;

constexpr core::TrialId kId{.seed = 1, .trial = 0};

sim::ScenarioConfig scenario() {
  sim::ScenarioConfig c;
  c.duration_s = 5.0;
  c.trajectory.handheld.rate_rms_rad_s = 0.75;
  c.camera.td_s = 0.02;
  c.camera.readout_s = 0.03;
  c.imu.noise = {1.7e-4, 2e-5, 2e-3, 3e-3};
  c.world.landmarks = 2000;
  c.points.per_frame = 40;
  c.prior.td_sigma_s = 0.02;
  return c;
}

sim::ScenarioConfig noise_free() {
  sim::ScenarioConfig c = scenario();
  c.imu.noise = {};
  c.camera.pixel_sigma_px = 0.0;
  c.prior.means = sim::PriorMeans::kTruth;
  c.prior.start = sim::PriorStart::kDrawn;
  return c;
}

estimator::EstimatorConfig believing_euroc() {
  estimator::EstimatorConfig c;
  c.imu = {1.7e-4, 2e-5, 2e-3, 3e-3};
  c.pixel_sigma_px = 1.0;
  return c;
}

double position_rms_m(const core::EstimateLog& estimate, const sim::GroundTruth& truth) {
  double sum = 0.0;
  for (const core::StampedState& s : estimate.states) {
    sum += (s.state.T_W_B.p - sim::state_at(truth, s.t_ns).T_W_B.p).squaredNorm();
  }
  return std::sqrt(sum / static_cast<double>(estimate.states.size()));
}

// A lens leaves the model exact: what remains is the integration of the IMU, as without one (batch_test).
TEST(EstimateWithDefects, ALensChangesNothingWithoutNoise) {
  const core::Distortion radtan(core::DistortionModel::kRadtan, {-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05});
  const core::Distortion fisheye(core::DistortionModel::kEquidistant, {0.0035, 0.0007, -0.002, 0.0002});
  for (const core::Distortion& lens : {radtan, fisheye}) {
    sim::ScenarioConfig c = noise_free();
    c.camera.model.distortion = lens;
    if (lens.model() == core::DistortionModel::kEquidistant) c.camera.model.fx_px = c.camera.model.fy_px = 190.0;
    const sim::Simulation s = sim::simulate(c, kId);
    const core::EstimateLog estimate = estimator::estimate(s.measurements, believing_euroc());
    ASSERT_EQ(estimate.status, core::SolveStatus::kConverged) << estimate.reason;
    EXPECT_LT(std::abs(estimate.calibration.td_s - 0.02), 1e-6);
    EXPECT_LT(std::abs(estimate.calibration.readout_s - 0.03), 5e-6);
    EXPECT_LT(position_rms_m(estimate, s.truth), 1e-3);
  }
}

// Samples 5 ms apart of which some are missing: the midpoint rule's error of a step grows with the cube of its length,
// 4^3 for a gap of three samples. Were the samples taken as equally spaced, each gap would cost 15 ms of motion.
TEST(EstimateWithDefects, ShortGapsAreBridgedByTheirLength) {
  sim::ScenarioConfig c = noise_free();
  c.imu.dropout_probability = 0.02;
  c.imu.dropout_samples = 3;
  const sim::Simulation s = sim::simulate(c, kId);
  ASSERT_LT(s.measurements.imu.size(), 980U);
  const core::EstimateLog estimate = estimator::estimate(s.measurements, believing_euroc());
  ASSERT_EQ(estimate.status, core::SolveStatus::kConverged) << estimate.reason;
  EXPECT_LT(std::abs(estimate.calibration.td_s - 0.02), 2e-5);
  EXPECT_LT(position_rms_m(estimate, s.truth), 5e-3);
}

// A stamp that is off by 0.1 ms is worth no more than that of motion, some 0.1 mrad and 0.1 mm.
TEST(EstimateWithDefects, JitteredStampsAreAccepted) {
  sim::ScenarioConfig c = noise_free();
  c.imu.stamp_jitter_s = 1e-4;
  const sim::Simulation s = sim::simulate(c, kId);
  const core::EstimateLog estimate = estimator::estimate(s.measurements, believing_euroc());
  ASSERT_EQ(estimate.status, core::SolveStatus::kConverged) << estimate.reason;
  EXPECT_LT(std::abs(estimate.calibration.td_s - 0.02), 1e-4);
  EXPECT_LT(position_rms_m(estimate, s.truth), 1e-2);
}

TEST(EstimateWithDefects, ALongGapIsANamedFailure) {
  core::MeasurementLog log = sim::simulate(scenario(), kId).measurements;
  const auto erase = [&](int n) { log.imu.erase(log.imu.begin() + 400, log.imu.begin() + 400 + n); };
  erase(19);  // 20 intervals of 5 ms: 100 ms
  EXPECT_NE(estimator::estimate(log, {}).status, core::SolveStatus::kFailedInitialisation);
  erase(1);
  const core::EstimateLog estimate = estimator::estimate(log, {});
  EXPECT_EQ(estimate.status, core::SolveStatus::kFailedInitialisation);
  EXPECT_THAT(estimate.reason, testing::HasSubstr("no IMU samples for 0.105 s after 1995000000 ns"));
}

// Simulated, written, read and estimated equals the run in memory, to the bit.
TEST(EstimateWithDefects, ARecordingOnDiskIsAsGoodAsInMemory) {
  sim::ScenarioConfig c = scenario();
  c.imu.dropout_probability = 0.01;
  c.imu.stamp_jitter_s = 1e-5;
  c.camera.model.distortion = {core::DistortionModel::kRadtan, {-0.283, 0.074, 2e-4, 2e-5}};
  c.camera.drop_probability = 0.05;
  c.points.loss_probability = 0.05;
  const sim::Simulation s = sim::simulate(c, kId);
  const fs::path folder = fs::path(testing::TempDir()) / "plumbline_estimate_with_defects";
  fs::remove_all(folder);
  core::write_dataset(folder, s.measurements, {.config_hash = "0123456789abcdef", .seed = 1, .trial = 0});
  const core::MeasurementLog read = core::read_dataset(folder);
  fs::remove_all(folder);

  int velocities = 0;
  int absent = 0;
  ASSERT_EQ(read.frames.size(), s.measurements.frames.size());
  for (std::size_t i = 0; i < read.frames.size(); ++i) {
    ASSERT_EQ(read.frames[i].points.size(), s.measurements.frames[i].points.size());
    for (std::size_t j = 0; j < read.frames[i].points.size(); ++j) {
      const core::PointObservation& point = read.frames[i].points[j];
      EXPECT_EQ(point.velocity, s.measurements.frames[i].points[j].velocity);
      ++(point.velocity ? velocities : absent);
    }
  }
  EXPECT_GT(velocities, 1000);
  EXPECT_GT(absent, 0);  // tracks of one frame
  EXPECT_EQ(read.camera.distortion.model(), core::DistortionModel::kRadtan);
  EXPECT_EQ(read.camera.distortion.coefficients(), s.measurements.camera.distortion.coefficients());

  const core::EstimateLog a = estimator::estimate(s.measurements, {});
  const core::EstimateLog b = estimator::estimate(read, {});
  EXPECT_EQ(a.status, b.status);
  EXPECT_EQ(a.calibration.td_s, b.calibration.td_s);
  EXPECT_EQ(a.calibration.readout_s, b.calibration.readout_s);
  EXPECT_EQ(a.covariance, b.covariance);
  ASSERT_EQ(a.states.size(), b.states.size());
  for (std::size_t i = 0; i < a.states.size(); ++i) {
    EXPECT_EQ(a.states[i].t_ns, b.states[i].t_ns);
    EXPECT_EQ(a.states[i].state.T_W_B.p, b.states[i].state.T_W_B.p);
    EXPECT_EQ(a.states[i].state.T_W_B.q.coeffs(), b.states[i].state.T_W_B.q.coeffs());
    EXPECT_EQ(a.states[i].state.v_W, b.states[i].state.v_W);
  }
}

}  // namespace
}  // namespace plumbline
