// The batch with camera timing `spline`: what it recovers without noise and how fast that falls with the knots, its
// agreement with `propagated`, its knots and its outcomes.
#include <cmath>
#include <optional>
#include <string>
#include <utility>

#include <gtest/gtest.h>

#include "core/error.h"
#include "estimator/estimate.h"
#include "short_recording.h"
#include "sim/simulate.h"
#include "simulated_lines.h"

namespace plumbline {
namespace {

using estimator::ObservationUse;
using testing::believing;
using testing::Errors;
using testing::errors_of;
using testing::kEurocLike;

estimator::EstimatorConfig on_spline(estimator::EstimatorConfig config,
                                     std::optional<double> knot_interval_s = std::nullopt, int order = 6) {
  config.timing = estimator::TimingModel::kSpline;
  config.spline = {.knot_spacing_s = knot_interval_s, .order = order};
  return config;
}

core::EstimateLog converged(const core::MeasurementLog& log, const estimator::EstimatorConfig& config) {
  core::EstimateLog estimate = estimator::estimate(log, config);
  EXPECT_EQ(estimate.status, core::SolveStatus::kConverged) << estimate.reason;
  return estimate;
}

// Points and lines without noise.
sim::Simulation exact_recording() {
  return testing::simulate_with_lines(testing::noise_free(testing::short_scenario(40), 200.0), {1, 0},
                                      {.sigma_px = 0.0});
}

TEST(SplineBatch, NoiseFreeRecoversTdReadoutAndTrajectory) {
  const sim::Simulation s = exact_recording();
  for (const ObservationUse use : {ObservationUse::kPoints, ObservationUse::kLines, ObservationUse::kPointsAndLines}) {
    estimator::EstimatorConfig config = on_spline(believing(kEurocLike, 1.0), 0.05);
    config.use = use;
    const core::EstimateLog estimate = converged(s.measurements, config);
    const Errors e = errors_of(estimate, s.truth);
    EXPECT_LT(std::abs(e.td_s), 1e-6) << static_cast<int>(use);
    EXPECT_LT(std::abs(e.readout_s), 1e-6) << static_cast<int>(use);
    EXPECT_LT(e.position_rms_m, 1e-4) << static_cast<int>(use);
  }
}

// What a spline of order k leaves of a smooth motion is of order h^k, as long as that is above the solver's tolerance.
TEST(SplineBatch, NoiseFreeErrorFallsWithTheKnotsAtItsOrder) {
  const sim::Simulation s = exact_recording();
  struct Case {
    int order;
    double wide_s;
  };
  for (const Case c : {Case{4, 0.1}, Case{6, 0.2}}) {
    const auto errors = [&](double interval_s) {
      estimator::EstimatorConfig config = on_spline(believing(kEurocLike, 1.0), interval_s, c.order);
      config.use = ObservationUse::kPoints;
      const core::EstimateLog estimate = converged(s.measurements, config);
      return std::pair(errors_of(estimate, s.truth), estimate.knots.value().interval_s);
    };
    const auto [wide, wide_s] = errors(c.wide_s);
    const auto [narrow, narrow_s] = errors(0.5 * c.wide_s);
    const double halvings = std::log(wide_s / narrow_s);
    EXPECT_NEAR(std::log(wide.position_rms_m / narrow.position_rms_m) / halvings, c.order, 1.0) << c.order;
    EXPECT_NEAR(std::log(wide.extrinsic_m / narrow.extrinsic_m) / halvings, c.order, 1.0) << c.order;
  }
}

// Two models of one recording: what differs is the noise of the gap, which `propagated` neglects, and the integration.
TEST(SplineBatch, AgreesWithPropagated) {
  const sim::Simulation s = testing::simulate_with_lines(testing::short_scenario(30), {1, 1}, {});
  for (const ObservationUse use : {ObservationUse::kPoints, ObservationUse::kLines, ObservationUse::kPointsAndLines}) {
    SCOPED_TRACE(static_cast<int>(use));
    estimator::EstimatorConfig config = believing(kEurocLike, 1.0);
    config.use = use;
    const core::EstimateLog states = converged(s.measurements, config);
    const core::EstimateLog spline = converged(s.measurements, on_spline(config));
    EXPECT_LT(spline.knots.value().excess_sigmas, core::KnotCheck::kMostSigmas);
    EXPECT_NEAR(spline.summary.cost_per_dof(), 1.0, 0.1);
    const auto sigma = [&](int i) { return std::sqrt(states.covariance(i, i)); };
    EXPECT_NEAR(spline.calibration.td_s, states.calibration.td_s, 0.3 * sigma(core::kCovTd));
    EXPECT_NEAR(spline.calibration.readout_s, states.calibration.readout_s, 0.3 * sigma(core::kCovReadout));
    ASSERT_EQ(spline.states.size(), states.states.size());
    for (std::size_t i = 0; i < states.states.size(); ++i) EXPECT_EQ(spline.states[i].t_ns, states.states[i].t_ns);
    const core::StateTangent d = core::minus(spline.states.back().state, states.states.back().state);
    for (int i = 0; i < core::kStateDof; ++i) EXPECT_LT(std::abs(d[i]), 0.5 * sigma(core::kCovLastState + i)) << i;
    for (int i = 0; i < core::kCovIntrinsics; ++i) {
      EXPECT_NEAR(std::sqrt(spline.covariance(i, i)) / sigma(i), 1.0, 0.05) << i;
    }
  }
}

TEST(SplineBatch, BothSolversAgree) {
  const auto s = sim::simulate(testing::short_scenario(40), {1, 0});
  estimator::EstimatorConfig config = on_spline({});
  const core::EstimateLog schur = converged(s.measurements, config);
  config.solver = estimator::Solver::kCeres;
  const core::EstimateLog ceres = converged(s.measurements, config);
  // As with states: both end after a step of a thousandth of a sigma.
  EXPECT_NEAR(schur.calibration.td_s, ceres.calibration.td_s, 1e-7);
  EXPECT_LT((schur.covariance - ceres.covariance).norm(), 1e-3 * schur.covariance.norm());
}

// Given knots that cannot follow the motion are an outcome; those by the motion are as dense as it takes, and denser
// for a lower order and for a motion of higher frequency.
TEST(SplineBatch, KnotsAreDenseEnoughOrSaidNotToBe) {
  const auto s = sim::simulate(testing::short_scenario(40), {1, 0});
  const core::EstimateLog coarse = estimator::estimate(s.measurements, on_spline({}, 0.2, 4));
  EXPECT_EQ(coarse.status, core::SolveStatus::kKnotsTooCoarse);
  EXPECT_NE(coarse.reason.find("knots 0.19"), std::string::npos) << coarse.reason;
  EXPECT_GT(coarse.knots.value().excess_sigmas, core::KnotCheck::kMostSigmas);

  const double usual_s = converged(s.measurements, on_spline({})).knots.value().interval_s;
  EXPECT_LT(converged(s.measurements, on_spline({}, std::nullopt, 4)).knots.value().interval_s, 0.6 * usual_s);
  sim::ScenarioConfig fast = testing::short_scenario(40);
  fast.trajectory.handheld.highest_frequency_hz = 4.0;
  const auto f = sim::simulate(fast, {1, 0});
  EXPECT_LT(converged(f.measurements, on_spline({})).knots.value().interval_s, 0.6 * usual_s);
}

TEST(SplineBatch, HoldsWhatIsNotFree) {
  sim::ScenarioConfig c = testing::short_scenario(40);
  c.prior.readout_sigma_s = 0.0;
  const auto s = sim::simulate(c, {1, 0});
  estimator::EstimatorConfig config = on_spline({});
  config.estimate = {.td = true, .readout = false, .extrinsics = false};
  const core::EstimateLog estimate = converged(s.measurements, config);
  EXPECT_EQ(estimate.calibration.readout_s, s.truth.calibration.readout_s);
  EXPECT_EQ(estimate.calibration.T_B_C.p, s.measurements.prior.calibration.T_B_C.p);
  EXPECT_EQ(estimate.covariance.topLeftCorner(6, 6).norm(), 0.0);
  EXPECT_GT(estimate.covariance(core::kCovTd, core::kCovTd), 0.0);
}

TEST(SplineBatch, IsOfTheBatchOnly) {
  const auto s = sim::simulate(testing::short_scenario(40), {1, 0});
  estimator::EstimatorConfig config = on_spline({});
  config.type = estimator::EstimatorType::kSlidingWindow;
  try {
    estimator::estimate(s.measurements, config);
    FAIL();
  } catch (const core::RuleError& error) {
    EXPECT_EQ(error.violation.key, "estimator.timing");
  }
}

}  // namespace
}  // namespace plumbline
