// The whole chain, simulator to evaluator, tells an honest covariance from one that is four times too large or too
// small: the mean NEES of short batch runs, on states and on a spline, lies inside its 99.9 % band, and outside with
// the covariance scaled.
#include <map>

#include <gtest/gtest.h>

#include "estimator/estimate.h"
#include "eval/statistics.h"
#include "nees_over_trials.h"
#include "sim/simulate.h"

namespace plumbline {
namespace {

using estimator::TimingModel;

constexpr int kTrials = 20;

sim::ScenarioConfig scenario() {
  sim::ScenarioConfig c;
  c.duration_s = 4.0;
  c.imu.noise = {1.7e-4, 2e-5, 2e-3, 3e-3};
  c.camera.td_s = 0.01;
  c.camera.readout_s = 0.02;
  c.world.landmarks = 1500;
  c.points.per_frame = 40;
  return c;
}

class PipelineConsistency : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    for (int trial = 0; trial < kTrials; ++trial) {
      const sim::Simulation s = sim::simulate(scenario(), {5, static_cast<std::uint64_t>(trial)});
      for (const TimingModel timing : {TimingModel::kPropagated, TimingModel::kSpline}) {
        estimator::EstimatorConfig config;
        config.timing = timing;
        const core::EstimateLog estimate = estimator::estimate(s.measurements, config);
        nees_[timing].add(estimate, s.truth);
        const core::SolveSummary& summary = estimate.summary;
        EXPECT_NEAR(summary.visual.squares + summary.inertial.squares + summary.prior.squares, 2.0 * summary.final_cost,
                    1e-9 * summary.final_cost);
        EXPECT_EQ(summary.visual.residuals + summary.inertial.residuals + summary.prior.residuals, summary.residuals);
      }
    }
  }

  static inline std::map<TimingModel, testing::NeesOverTrials> nees_;
};

TEST_F(PipelineConsistency, HonestCovariancesAreInsideTheirBands) {
  for (const auto& [timing, nees] : nees_) nees.expect_inside_bands();
}

TEST_F(PipelineConsistency, ScaledCovariancesAreOutside) {
  for (const auto& [timing, nees] : nees_) {
    nees.expect_scaled_outside({"extrinsic", "calibration", "final_pose", "final_state", "joint"});
  }
}

TEST_F(PipelineConsistency, ResidualsAreAsLargeAsTheirNoise) {
  for (const auto& [timing, nees] : nees_) nees.expect_residuals_as_large_as_their_noise();
}

TEST_F(PipelineConsistency, ResidualsTellNoiseThatIsNotAsBelieved) {
  const sim::Simulation s = sim::simulate(scenario(), {5, 0});
  for (const double believed_px : {0.8, 1.25}) {
    estimator::EstimatorConfig config;
    config.pixel_sigma_px = believed_px;
    const core::SolveSummary summary = estimator::estimate(s.measurements, config).summary;
    const int dof = summary.residuals - summary.parameters;
    EXPECT_FALSE(eval::chi_square_mean_band(dof, 1, 0.999).contains(2.0 * summary.final_cost)) << believed_px;
  }
}

}  // namespace
}  // namespace plumbline
