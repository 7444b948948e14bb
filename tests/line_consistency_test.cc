// Lines alone, whole chain: the mean NEES of short batch runs lies inside its 99.9 % band, and outside with the
// covariance scaled; the residuals at the truth are the noise.
#include <array>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "estimator/estimate.h"
#include "estimator/factors/line_factors.h"
#include "estimator/keyframes.h"
#include "eval/evaluate.h"
#include "eval/statistics.h"
#include "simulated_lines.h"

namespace plumbline {
namespace {

constexpr int kTrials = 12;

sim::ScenarioConfig scenario() {
  sim::ScenarioConfig c;
  c.duration_s = 4.0;
  c.trajectory.handheld.rate_rms_rad_s = 0.75;
  c.imu.noise = {1.7e-4, 2e-5, 2e-3, 3e-3};
  c.camera.td_s = 0.01;
  c.camera.readout_s = 0.03;
  c.points.per_frame = 1;
  return c;
}

struct Nees {
  std::vector<double> values;
  int dof = 0;
};

class LineConsistency : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    estimator::EstimatorConfig config;
    config.use = estimator::ObservationUse::kLines;
    for (int trial = 0; trial < kTrials; ++trial) {
      const sim::Simulation s =
          testing::simulate_with_lines(scenario(), {5, static_cast<std::uint64_t>(trial)}, {.per_frame = 20});
      core::EstimateLog estimate = estimator::estimate(s.measurements, config);
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
    }
  }

  static inline std::map<double, std::map<std::string, Nees>> nees_;  // by the covariance's scale and the block
  static inline double squares_ = 0.0;
  static inline int dof_ = 0;
};

TEST_F(LineConsistency, HonestCovariancesAreInsideTheirBands) {
  ASSERT_EQ(nees_[1.0].at("joint").dof, core::kCovDim);
  for (const auto& [name, nees] : nees_[1.0]) {
    const eval::Interval band = eval::chi_square_mean_band(nees.dof, kTrials, 0.999);
    const double mean = eval::mean(nees.values);
    EXPECT_TRUE(band.contains(mean)) << name << ": " << mean << " not in [" << band.lo << ", " << band.hi << "]";
  }
}

TEST_F(LineConsistency, ScaledCovariancesAreOutside) {
  for (const char* name : {"calibration", "final_state", "joint"}) {
    const eval::Interval band = eval::chi_square_mean_band(nees_[1.0].at(name).dof, kTrials, 0.999);
    EXPECT_LT(eval::mean(nees_[4.0].at(name).values), band.lo) << name;
    EXPECT_GT(eval::mean(nees_[0.25].at(name).values), band.hi) << name;
  }
}

// The residuals of all trials together are a chi-square variable of residuals - parameters.
TEST_F(LineConsistency, ResidualsAreAsLargeAsTheirNoise) {
  const eval::Interval band = eval::chi_square_mean_band(dof_, 1, 0.999);
  EXPECT_TRUE(band.contains(squares_)) << squares_ / dof_;
}

TEST(LineResiduals, AtTheTruthAreTheSimulatedNoise) {
  sim::ScenarioConfig c = scenario();
  c.imu.rate_hz = 800.0;  // so that the integrator's own error is far below the noise
  c.imu.noise = {1.7e-5, 2e-6, 2e-4, 3e-4};
  const auto s = testing::simulate_with_lines(c, {5, 0}, {.sigma_px = 0.7});
  const core::MeasurementLog& log = s.measurements;
  const core::RigCalibration& rig = s.truth.calibration;
  const estimator::PoseBlock extrinsics = estimator::pack(rig.T_B_C);
  const estimator::CameraModel model{log.camera, 0.7, c.gravity_m_s2};
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  Eigen::Matrix2d squares = Eigen::Matrix2d::Zero();
  int n = 0;
  for (const core::Frame& frame : log.frames) {
    const double t_s = core::to_seconds(frame.t_cam_ns) + rig.td_s;
    const auto sample = static_cast<std::size_t>(std::llround(t_s * c.imu.rate_hz));
    if (sample >= log.imu.size()) continue;
    const core::State& state = s.truth.states[sample].state;
    const estimator::FrameTiming timing{std::make_shared<estimator::LocalMotion>(log.imu, sample, 0.05, state.bias),
                                        core::to_seconds(frame.t_cam_ns - log.imu[sample].t_ns)};
    const estimator::StateBlock x = estimator::pack(state);
    for (const core::LineObservation& o : frame.lines) {
      const auto& ends = s.truth.segments_W[static_cast<std::size_t>(s.truth.track_segment.at(o.track_id))].ends_W;
      const Eigen::Vector3d& origin = state.T_W_B.p;
      const auto line = estimator::orthonormal_line(estimator::line_through(ends[0] - origin, ends[1] - origin));
      const estimator::PropagatedLineFactor factor(model, timing, origin, o.ends_px);
      const std::array<const double*, 5> blocks = {x.data(), extrinsics.data(), &rig.td_s, &rig.readout_s,
                                                   line->data()};
      Eigen::Vector2d r;
      if (!factor.Evaluate(blocks.data(), r.data(), nullptr)) continue;  // the last rows leave the samples
      sum += r;
      squares += r * r.transpose();
      ++n;
    }
  }
  ASSERT_GT(n, 1000);
  const double root_n = std::sqrt(n);
  // 4.5 sigma of the mean and of the second moments.
  for (int i = 0; i < 2; ++i) {
    EXPECT_LT(std::abs(sum[i]) / n, 4.5 / root_n);
    EXPECT_NEAR(squares(i, i) / n, 1.0, 4.5 * std::sqrt(2.0) / root_n);
  }
  EXPECT_LT(std::abs(squares(0, 1)) / n, 4.5 / root_n);
}

}  // namespace
}  // namespace plumbline
