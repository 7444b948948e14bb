// The whole chain, simulator to evaluator, tells an honest covariance from one that is four times too large or too
// small: the mean NEES of short batch runs lies inside its 99.9 % band, and outside with the covariance scaled.
#include <map>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "estimator/estimate.h"
#include "eval/evaluate.h"
#include "eval/statistics.h"
#include "eval/summary.h"
#include "sim/simulate.h"

namespace plumbline {
namespace {

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

struct Nees {
  std::vector<double> values;
  int dof = 0;
};

class PipelineConsistency : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    for (int trial = 0; trial < kTrials; ++trial) {
      const sim::Simulation s = sim::simulate(scenario(), {5, static_cast<std::uint64_t>(trial)});
      core::EstimateLog estimate = estimator::estimate(s.measurements, {});
      const core::PosteriorCovariance honest = estimate.covariance;
      for (const double scale : {1.0, 4.0, 0.25}) {
        estimate.covariance = scale * honest;
        const eval::TrialResult result = eval::evaluate(estimate, s.truth, {});
        ASSERT_TRUE(result.ok) << "trial " << trial << ": " << result.reason;
        for (const eval::Metric& m : result.metrics) {
          if (!m.nees) continue;
          Nees& nees = nees_[scale][m.name];
          nees.values.push_back(*m.nees);
          nees.dof = m.nees_dof;
        }
      }
      squares_ += 2.0 * estimate.summary.final_cost;
      dof_ += estimate.summary.residuals - estimate.summary.parameters;
      const core::SolveSummary& summary = estimate.summary;
      EXPECT_NEAR(summary.visual.squares + summary.inertial.squares + summary.prior.squares, 2.0 * summary.final_cost,
                  1e-9 * summary.final_cost);
      EXPECT_EQ(summary.visual.residuals + summary.inertial.residuals + summary.prior.residuals, summary.residuals);
    }
  }

  static void expect_inside(const std::string& name) {
    const Nees& nees = nees_[1.0].at(name);
    const eval::Interval band = eval::chi_square_mean_band(nees.dof, kTrials, 0.999);
    const double mean = eval::mean(nees.values);
    EXPECT_TRUE(band.contains(mean)) << name << ": " << mean << " not in [" << band.lo << ", " << band.hi << "]";
  }

  static inline std::map<double, std::map<std::string, Nees>> nees_;  // by the covariance's scale and the block
  static inline double squares_ = 0.0;
  static inline int dof_ = 0;
};

TEST_F(PipelineConsistency, HonestCovariancesAreInsideTheirBands) {
  for (const auto& [name, nees] : nees_[1.0]) expect_inside(name);
  EXPECT_EQ(nees_[1.0].at("joint").dof, core::kCovDim);
}

TEST_F(PipelineConsistency, ScaledCovariancesAreOutside) {
  for (const char* name : {"extrinsic", "calibration", "final_pose", "final_state", "joint"}) {
    const eval::Interval band = eval::chi_square_mean_band(nees_[1.0].at(name).dof, kTrials, 0.999);
    EXPECT_LT(eval::mean(nees_[4.0].at(name).values), band.lo) << name;
    EXPECT_GT(eval::mean(nees_[0.25].at(name).values), band.hi) << name;
  }
}

// The residuals of all trials together are a chi-square variable of residuals - parameters.
TEST_F(PipelineConsistency, ResidualsAreAsLargeAsTheirNoise) {
  const eval::Interval band = eval::chi_square_mean_band(dof_, 1, 0.999);
  EXPECT_TRUE(band.contains(squares_)) << squares_ / dof_;
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
