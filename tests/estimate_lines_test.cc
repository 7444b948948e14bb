// The batch on lines as the simulator makes them: behind a lens, and with the defects of a tracker.
#include <cmath>
#include <cstdint>
#include <utility>

#include <gtest/gtest.h>

#include "core/distortion.h"
#include "estimator/estimate.h"
#include "short_recording.h"
#include "sim/simulate.h"

namespace plumbline {
namespace {

using testing::errors_of;

constexpr core::TrialId kId{.seed = 1, .trial = 0};

sim::ScenarioConfig line_rooms() {
  sim::ScenarioConfig c = testing::short_scenario(20);
  c.world.type = sim::WorldType::kRooms;
  c.world.lines.random = 800;
  c.lines.per_frame = 25;
  return c;
}

// A lens leaves the model exact: what remains is the integration of the IMU, as without one (line_batch_test).
TEST(EstimateLines, ALensChangesNothingWithoutNoise) {
  const core::Distortion radtan(core::DistortionModel::kRadtan, {-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05});
  const core::Distortion fisheye(core::DistortionModel::kEquidistant, {0.0035, 0.0007, -0.002, 0.0002});
  for (const core::Distortion& lens : {radtan, fisheye}) {
    sim::ScenarioConfig c = testing::noise_free(line_rooms(), 200.0);
    c.lines.sigma_px = 0.0;
    c.camera.model.distortion = lens;
    if (lens.model() == core::DistortionModel::kEquidistant) c.camera.model.fx_px = c.camera.model.fy_px = 190.0;
    const sim::Simulation s = sim::simulate(c, kId);
    estimator::EstimatorConfig believed = testing::believing(testing::kEurocLike, 1.0);
    believed.use = estimator::ObservationUse::kLines;
    const core::EstimateLog estimate = estimator::estimate(s.measurements, believed);
    ASSERT_EQ(estimate.status, core::SolveStatus::kConverged) << estimate.reason;
    EXPECT_GT(estimate.lines.size(), 20U);
    EXPECT_LT(std::abs(errors_of(estimate, s.truth).td_s), 1e-6);
    EXPECT_LT(errors_of(estimate, s.truth).position_rms_m, 1e-3);
  }
}

// From draws that had ended short of a minimum: a walk that hardly turns the camera, where few lines have much
// parallax, and a lively one whose first steps fail.
TEST(EstimateLines, LinesAloneFindTheirMinimum) {
  sim::ScenarioConfig lively = line_rooms();
  lively.duration_s = 10.0;
  lively.world.lines.windows.spacing_m = 2.0;
  lively.lines.per_frame = 40;
  sim::ScenarioConfig walk = lively;
  walk.trajectory.type = sim::TrajectoryType::kFigureEight;
  walk.trajectory.loop.radius_m = 5.0;
  walk.trajectory.loop.height_amplitude_m = 0.05;
  walk.trajectory.loop.period_s = 22.0;
  estimator::EstimatorConfig config;
  config.use = estimator::ObservationUse::kLines;
  for (const auto& [scenario, trial] : {std::pair(walk, 0), {walk, 1}, {lively, 2}}) {
    const sim::Simulation s = sim::simulate(scenario, {.seed = 1, .trial = static_cast<std::uint64_t>(trial)});
    const core::EstimateLog estimate = estimator::estimate(s.measurements, config);
    EXPECT_EQ(estimate.status, core::SolveStatus::kConverged) << trial << ": " << estimate.reason;
    EXPECT_LT(estimate.summary.iterations, 35) << trial;  // 12 to 20, by the rounding; all 50 where it is stuck
  }
}

// Ends that slide are still on their line, and parts of a segment are on one line: neither is an error. Wrong matches
// are, and a robust loss with culling leaves them without effect; without either they are not.
TEST(EstimateLines, ATrackersDefectsAreBorne) {
  sim::ScenarioConfig c = line_rooms();
  c.lines.slide_sigma_px = 10.0;
  c.lines.fragment_probability = 0.02;
  c.lines.merge_probability = 0.1;
  c.lines.loss_probability = 0.02;
  c.lines.wrong_match_probability = 0.02;
  const sim::Simulation s = sim::simulate(c, kId);
  estimator::EstimatorConfig config;
  config.use = estimator::ObservationUse::kLines;
  estimator::EstimatorConfig believing_all = config;
  believing_all.lines.cull_sigma = 1e6;
  believing_all.max_iterations = 10;
  const core::EstimateLog misled = estimator::estimate(s.measurements, believing_all);
  EXPECT_GT(misled.summary.visual.squares / misled.summary.visual.residuals, 3.0);
  for (const estimator::RobustLoss loss : {estimator::RobustLoss::kHuber, estimator::RobustLoss::kCauchy}) {
    config.loss = loss;
    const core::EstimateLog estimate = estimator::estimate(s.measurements, config);
    ASSERT_EQ(estimate.status, core::SolveStatus::kConverged) << estimate.reason;
    // 4.5 sigma: 7 in a million.
    const double sigma_s = std::sqrt(estimate.covariance(core::kCovTd, core::kCovTd));
    EXPECT_LT(std::abs(errors_of(estimate, s.truth).td_s), 4.5 * sigma_s);
    EXPECT_LT(sigma_s, 0.5e-3);
    EXPECT_LT(estimate.summary.visual.squares / estimate.summary.visual.residuals, 1.5);
  }
}

}  // namespace
}  // namespace plumbline
