// Lines alone, whole chain: the mean NEES of short batch runs lies inside its 99.9 % band, and outside with the
// covariance scaled; the residuals at the truth are the noise.
#include <array>
#include <memory>

#include <gtest/gtest.h>

#include "estimator/estimate.h"
#include "estimator/factors/line_factors.h"
#include "estimator/keyframes.h"
#include "nees_over_trials.h"
#include "simulated_lines.h"
#include "whitened_moments.h"

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

class LineConsistency : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    estimator::EstimatorConfig config;
    config.use = estimator::ObservationUse::kLines;
    for (int trial = 0; trial < kTrials; ++trial) {
      const sim::Simulation s =
          testing::simulate_with_lines(scenario(), {5, static_cast<std::uint64_t>(trial)}, {.per_frame = 20});
      nees_.add(estimator::estimate(s.measurements, config), s.truth);
    }
  }

  static inline testing::NeesOverTrials nees_;
};

TEST_F(LineConsistency, HonestCovariancesAreInsideTheirBands) { nees_.expect_inside_bands(); }

TEST_F(LineConsistency, ScaledCovariancesAreOutside) {
  nees_.expect_scaled_outside({"calibration", "final_state", "joint"});
}

TEST_F(LineConsistency, ResidualsAreAsLargeAsTheirNoise) { nees_.expect_residuals_as_large_as_their_noise(); }

TEST(LineResiduals, AtTheTruthAreTheSimulatedNoise) {
  sim::ScenarioConfig c = scenario();
  c.imu.rate_hz = 800.0;  // so that the integrator's own error is far below the noise
  c.imu.noise = {1.7e-5, 2e-6, 2e-4, 3e-4};
  const auto s = testing::simulate_with_lines(c, {5, 0}, {.sigma_px = 0.7});
  const core::MeasurementLog& log = s.measurements;
  const core::RigCalibration& rig = s.truth.calibration;
  const estimator::PoseBlock extrinsics = estimator::pack(rig.T_B_C);
  const estimator::CameraModel model{log.camera, 0.7, c.gravity_m_s2};
  testing::WhitenedMoments moments;
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
      moments.add(r);
    }
  }
  ASSERT_GT(moments.n, 1000);
  moments.expect_standard_normal();
}

}  // namespace
}  // namespace plumbline
