#include "eval/evaluate.h"

#include <cmath>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Dense>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "core/lie.h"
#include "core/state.h"

namespace plumbline::eval {
namespace {

using core::EstimateLog;
using core::TimeNs;

constexpr TimeNs kImuStep = 5'000'000;
constexpr int kStates = 250;
constexpr int kStatesEvery = 20;  // IMU samples

sim::GroundTruth make_truth() {
  sim::GroundTruth truth;
  truth.calibration = {.T_B_C = {core::exp_quaternion(Eigen::Vector3d(1.0, -0.5, 0.3)), {0.05, -0.02, 0.01}},
                       .td_s = 0.01,
                       .readout_s = 0.02,
                       .intrinsics = core::Intrinsics(460.0, 458.0, 320.0, 240.0)};
  for (int k = 0; k < kStates * kStatesEvery; ++k) {
    const TimeNs t_ns = 1403636580'000000000 + k * kImuStep;
    const double u = core::to_seconds(k * kImuStep);
    core::State x;
    x.T_W_B = {core::exp_quaternion(Eigen::Vector3d(0.4 * std::sin(u), 0.3, 0.2 * u)),
               {2.0 * std::cos(u), std::sin(1.3 * u), 0.2 * u}};
    x.v_W = {-2.0 * std::sin(u), 1.3 * std::cos(1.3 * u), 0.2};
    x.bias = {{0.01, 0.02, -0.01}, {0.1, -0.2, 0.05}};
    truth.states.push_back({t_ns, x});
  }
  return truth;
}

// A positive definite matrix with correlations between all blocks.
core::PosteriorCovariance make_covariance() {
  core::PosteriorCovariance A;
  for (int i = 0; i < core::kCovDim; ++i) {
    for (int j = 0; j < core::kCovDim; ++j) A(i, j) = std::sin(1.0 + 7.0 * i + 3.0 * j * j) + (i == j ? 3.0 : 0.0);
  }
  return 1e-6 * A * A.transpose();
}

EstimateLog perfect(const sim::GroundTruth& truth) {
  EstimateLog estimate;
  estimate.status = core::SolveStatus::kConverged;
  for (std::size_t k = 0; k < truth.states.size(); k += kStatesEvery) estimate.states.push_back(truth.states[k]);
  estimate.calibration = truth.calibration;
  estimate.td_estimated = true;
  estimate.readout_estimated = true;
  estimate.extrinsics_estimated = true;
  estimate.covariance = make_covariance();
  estimate.summary = {.iterations = 9,
                      .final_cost = 50.0,
                      .residuals = 120,
                      .parameters = 20,
                      .landmarks = 7,
                      .observations = 60,
                      .visual = {.squares = 60.0, .residuals = 80},
                      .inertial = {.squares = 27.0, .residuals = 30},
                      .prior = {}};
  return estimate;
}

const Metric& metric(const TrialResult& result, std::string_view name) {
  for (const Metric& m : result.metrics) {
    if (m.name == name) return m;
  }
  throw std::out_of_range(std::string(name));
}

class Evaluate : public testing::Test {
 protected:
  Evaluate() {
    error_.setLinSpaced(-3e-3, 4e-3);
    core::RigCalibration& c = estimate_.calibration;
    c.T_B_C.p += error_.segment<3>(core::kCovExtrinsicPosition);
    c.T_B_C.q = c.T_B_C.q * core::exp_quaternion(error_.segment<3>(core::kCovExtrinsicRotation));
    c.td_s += error_(core::kCovTd);
    c.readout_s += error_(core::kCovReadout);
    *c.intrinsics += error_.segment<4>(core::kCovIntrinsics);
    core::State& last = estimate_.states.back().state;
    last = core::plus(last, error_.segment<core::kStateDof>(core::kCovLastState));
  }

  TrialResult evaluate(Alignment alignment = Alignment::kPosyaw) const {
    return eval::evaluate(estimate_, truth_, {.alignment = alignment});
  }

  void expect_unusable(const std::string& reason) const {
    const TrialResult result = evaluate();
    EXPECT_FALSE(result.ok);
    EXPECT_EQ(result.status, "unusable");
    EXPECT_EQ(result.reason, reason);
    EXPECT_TRUE(result.metrics.empty());
    EXPECT_TRUE(result.series.points.empty());
  }

  sim::GroundTruth truth_ = make_truth();
  EstimateLog estimate_ = perfect(truth_);
  Eigen::Matrix<double, core::kCovDim, 1> error_;  // of estimate_, in the order of its covariance
};

TEST_F(Evaluate, ErrorsAreEstimateMinusTruth) {
  const TrialResult result = evaluate();
  ASSERT_TRUE(result.ok) << result.reason;
  EXPECT_EQ(result.status, "converged");
  EXPECT_NEAR(metric(result, "td_error_s").value, error_(core::kCovTd), 1e-15);
  EXPECT_NEAR(metric(result, "readout_error_s").value, error_(core::kCovReadout), 1e-15);
  EXPECT_NEAR(metric(result, "extrinsic_position_m").value, error_.segment<3>(0).norm(), 1e-15);
  EXPECT_NEAR(metric(result, "extrinsic_rotation_deg").value, error_.segment<3>(3).norm() * core::kDegreesPerRadian,
              1e-12);
  EXPECT_NEAR(metric(result, "extrinsic").value, error_.segment<3>(0).norm(), 1e-15);
  EXPECT_NEAR(metric(result, "final_pose").value, error_.segment<3>(8).norm(), 1e-12);
  EXPECT_NEAR(metric(result, "final_velocity").value, error_.segment<3>(14).norm(), 1e-12);
  EXPECT_NEAR(metric(result, "final_gyro_bias").value, error_.segment<3>(17).norm(), 1e-14);
  EXPECT_NEAR(metric(result, "final_accel_bias").value, error_.segment<3>(20).norm(), 1e-14);
  EXPECT_NEAR(metric(result, "final_bias").value, error_.segment<3>(17).norm(), 1e-14);
}

TEST_F(Evaluate, HoldsEveryMetricOfTheRegistryInItsOrder) {
  const TrialResult result = evaluate();
  // The last fourteen: lines, restarts, knots, a history of td, from scratch, the bound.
  ASSERT_EQ(result.metrics.size(), kMetrics.size() - 14);
  for (std::size_t i = 0; i < result.metrics.size(); ++i) EXPECT_EQ(result.metrics[i].name, kMetrics[i].name);
}

TEST_F(Evaluate, NeesIsOfTheRightBlockAndDimension) {
  struct Block {
    std::string_view name;
    int offset;
    int dof;
  };
  const TrialResult result = evaluate();
  for (const Block& b :
       {Block{"extrinsic_position_m", 0, 3}, Block{"extrinsic_rotation_deg", 3, 3}, Block{"extrinsic", 0, 6},
        Block{"td_error_s", 6, 1}, Block{"readout_error_s", 7, 1}, Block{"focal_error_px", 23, 2},
        Block{"principal_point_error_px", 25, 2}, Block{"intrinsics", 23, 4}, Block{"final_pose", 8, 6},
        Block{"final_position", 8, 3}, Block{"final_orientation_deg", 11, 3}, Block{"final_velocity", 14, 3},
        Block{"final_gyro_bias", 17, 3}, Block{"final_accel_bias", 20, 3}, Block{"final_bias", 17, 6},
        Block{"final_state", 8, 15}, Block{"joint", 0, 27}}) {
    const Eigen::VectorXd e = error_.segment(b.offset, b.dof);
    const Eigen::MatrixXd P = estimate_.covariance.block(b.offset, b.offset, b.dof, b.dof);
    const Metric& m = metric(result, b.name);
    EXPECT_EQ(m.nees_dof, b.dof) << b.name;
    EXPECT_NEAR(m.nees.value_or(0.0) / e.dot(P.ldlt().solve(e)), 1.0, 1e-8) << b.name;
  }
  EXPECT_EQ(metric(result, "calibration").nees_dof, 12);
  EXPECT_FALSE(metric(result, "ate_position_m").nees.has_value());
  EXPECT_FALSE(metric(result, "ate_rotation_deg").nees.has_value());
}

// td_first = td_middle - readout/2, with the joint covariance: their correlation decides its variance.
TEST_F(Evaluate, FirstRowTdIsAFunctionOfBoth) {
  const TrialResult result = evaluate();
  const Metric& m = metric(result, "td_first_error_s");
  const double e = error_(core::kCovTd) - 0.5 * error_(core::kCovReadout);
  const core::PosteriorCovariance& P = estimate_.covariance;
  const double variance = P(core::kCovTd, core::kCovTd) - P(core::kCovTd, core::kCovReadout) +
                          0.25 * P(core::kCovReadout, core::kCovReadout);
  EXPECT_NEAR(m.value, e, 1e-15);
  EXPECT_NEAR(m.nees.value_or(0.0) / (e * e / variance), 1.0, 1e-10);
  EXPECT_EQ(m.nees_dof, 1);
}

TEST_F(Evaluate, JointBlocksHoldWhatIsEstimated) {
  estimate_.calibration.intrinsics.reset();
  estimate_.readout_estimated = false;
  estimate_.extrinsics_estimated = false;
  const int bias = core::kCovLastState + core::kGyroBias;
  estimate_.covariance.middleRows<6>(bias).setZero();
  estimate_.covariance.middleCols<6>(bias).setZero();
  const TrialResult result = evaluate();
  ASSERT_TRUE(result.ok) << result.reason;
  EXPECT_EQ(metric(result, "calibration").nees_dof, 1);
  EXPECT_NEAR(metric(result, "calibration").nees.value_or(0.0) / metric(result, "td_error_s").nees.value_or(1.0), 1.0,
              1e-12);
  EXPECT_EQ(metric(result, "final_state").nees_dof, 9);
  EXPECT_EQ(metric(result, "joint").nees_dof, 10);
}

TEST_F(Evaluate, ResidualsByKind) {
  const TrialResult result = evaluate();
  EXPECT_DOUBLE_EQ(metric(result, "nis_visual").value, 0.75);
  EXPECT_DOUBLE_EQ(metric(result, "nis_inertial").value, 0.9);
}

// The error of td enters the bound of 1 ms, leaves it once more, and enters it for good.
TEST_F(Evaluate, TdHasConvergedOnceItStaysWithinTheBound) {
  const double td_s = truth_.calibration.td_s;
  const core::TimeNs start = estimate_.states.front().t_ns;
  for (const auto& [t_s, error_s] : {std::pair(0.5, 5e-3), std::pair(1.0, 0.5e-3), std::pair(1.5, -1.1e-3),
                                     std::pair(2.0, -0.9e-3), std::pair(2.5, 1e-4)}) {
    estimate_.td_history.push_back({start + core::to_ns(t_s), td_s + error_s, 1e-3});
  }
  const Metric converged = metric(evaluate(), "td_convergence_s");
  EXPECT_DOUBLE_EQ(converged.value, 2.0);
  EXPECT_FALSE(converged.censored);
  estimate_.td_history.push_back({start + core::to_ns(3.0), td_s + 2e-3, 1e-3});
  const Metric never = metric(evaluate(), "td_convergence_s");
  EXPECT_DOUBLE_EQ(never.value, 3.0);
  EXPECT_TRUE(never.censored);
}

TEST_F(Evaluate, OnlyTheAteIsAligned) {
  const core::Pose T{core::exp_quaternion(Eigen::Vector3d(0.0, 0.0, 0.3)), {1.0, 2.0, 3.0}};
  for (auto& stamped : estimate_.states) stamped.state.T_W_B = T * stamped.state.T_W_B;
  const TrialResult posyaw = evaluate(Alignment::kPosyaw);
  const TrialResult none = evaluate(Alignment::kNone);
  EXPECT_LT(metric(posyaw, "ate_position_m").value, 1e-3);
  EXPECT_GT(metric(none, "ate_position_m").value, 1.0);
  EXPECT_NEAR(metric(none, "ate_rotation_deg").value, 0.3 * core::kDegreesPerRadian, 0.1);
  EXPECT_EQ(metric(posyaw, "final_pose").value, metric(none, "final_pose").value);
  EXPECT_EQ(metric(posyaw, "final_pose").nees, metric(none, "final_pose").nees);
  EXPECT_GT(metric(posyaw, "final_pose").value, 1.0);
}

TEST_F(Evaluate, WithoutAnEstimateThereIsNoNees) {
  estimate_.td_estimated = false;
  estimate_.readout_estimated = false;
  estimate_.extrinsics_estimated = false;
  for (const int held : {core::kCovTd, core::kCovReadout}) {
    estimate_.covariance.row(held).setZero();
    estimate_.covariance.col(held).setZero();
  }
  const int bias = core::kCovLastState + core::kGyroBias;
  estimate_.covariance.middleRows<6>(bias).setZero();
  estimate_.covariance.middleCols<6>(bias).setZero();
  const TrialResult result = evaluate();
  ASSERT_TRUE(result.ok) << result.reason;
  for (const char* name :
       {"td_error_s", "readout_error_s", "extrinsic", "extrinsic_position_m", "extrinsic_rotation_deg", "final_bias"}) {
    EXPECT_FALSE(metric(result, name).nees.has_value()) << name;
    EXPECT_EQ(metric(result, name).nees_dof, 0) << name;
  }
  EXPECT_NEAR(metric(result, "td_error_s").value, error_(core::kCovTd), 1e-15);
  EXPECT_TRUE(metric(result, "final_pose").nees.has_value());
}

TEST_F(Evaluate, IntrinsicsThatWereHeldHaveNoMetric) {
  estimate_.calibration.intrinsics.reset();
  const TrialResult result = evaluate();
  ASSERT_TRUE(result.ok) << result.reason;
  EXPECT_EQ(metric(result, "calibration").nees_dof, 8);
  EXPECT_EQ(metric(result, "joint").nees_dof, 23);
  for (const Metric& m : result.metrics) EXPECT_EQ(m.name.find("_px"), std::string::npos) << m.name;
}

TEST_F(Evaluate, AnEstimatorWithoutCovarianceIsScoredWithoutNees) {
  estimate_.covariance.setZero();
  const TrialResult result = evaluate();
  ASSERT_TRUE(result.ok) << result.reason;
  for (const Metric& m : result.metrics) EXPECT_FALSE(m.nees.has_value()) << m.name;
}

TEST_F(Evaluate, ASingularCovarianceFailsTheTrial) {
  estimate_.covariance.row(core::kCovTd).setZero();
  estimate_.covariance.col(core::kCovTd).setZero();
  expect_unusable("the covariance of td_error_s is singular or indefinite");
}

TEST_F(Evaluate, APartlyZeroBlockFailsTheTrial) {
  const int accel = core::kCovLastState + core::kAccelBias;
  estimate_.covariance.middleRows<3>(accel).setZero();
  estimate_.covariance.middleCols<3>(accel).setZero();
  expect_unusable("the covariance of final_bias is singular or indefinite");
}

TEST_F(Evaluate, ValuesThatAreNotFiniteFailTheTrial) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  const EstimateLog sound = estimate_;
  estimate_.states[4].state.T_W_B.p.x() = kNan;
  expect_unusable("pose 4 is not finite");
  const std::string rest = "a velocity, bias, calibration or covariance is not finite";
  estimate_ = sound;
  estimate_.states[4].state.bias.accel_m_s2.x() = kNan;
  expect_unusable(rest);
  estimate_ = sound;
  estimate_.calibration.td_s = kNan;
  expect_unusable(rest);
  estimate_ = sound;
  estimate_.covariance(2, 3) = kNan;
  expect_unusable(rest);
  estimate_ = sound;
  estimate_.summary.final_cost = kNan;
  expect_unusable("the final cost is not finite");
}

TEST_F(Evaluate, StampsThatCannotBeScoredFailTheTrial) {
  const EstimateLog sound = estimate_;
  estimate_.states[5].t_ns = estimate_.states[4].t_ns;
  expect_unusable("pose 5 has a duplicate stamp");
  estimate_ = sound;
  std::swap(estimate_.states[5], estimate_.states[6]);
  expect_unusable("pose 6 has an unsorted stamp");
  estimate_ = sound;
  estimate_.states.resize(2);
  expect_unusable("2 poses where 3 are needed");
  estimate_ = sound;
  estimate_.states.clear();
  expect_unusable("0 poses where 3 are needed");
  estimate_ = sound;
  estimate_.states.back().t_ns += 10 * core::kNsPerSecond;
  expect_unusable("the state at " + std::to_string(estimate_.states.back().t_ns) + " ns lies outside the recording");
}

TEST_F(Evaluate, WhatDidNotConvergeIsNotMeasured) {
  estimate_.status = core::SolveStatus::kIterationLimit;
  estimate_.reason = "50 iterations";
  const TrialResult result = evaluate();
  EXPECT_FALSE(result.ok);
  EXPECT_EQ(result.status, "iteration_limit");
  EXPECT_EQ(result.reason, "50 iterations");
  EXPECT_TRUE(result.metrics.empty());
  EXPECT_EQ(result.solver.iterations, 9);
  EXPECT_DOUBLE_EQ(result.solver.cost_per_dof, 1.0);
}

TEST_F(Evaluate, SeriesHoldsTheTrialOnAGrid) {
  for (const auto& stamped : estimate_.states) {
    estimate_.td_history.push_back({stamped.t_ns, truth_.calibration.td_s + 1e-3, 2e-3});
  }
  const TrialResult result = evaluate(Alignment::kNone);
  const Series& series = result.series;
  ASSERT_EQ(series.points.size(), static_cast<std::size_t>(kSeriesPoints));
  EXPECT_EQ(series.points.front().t_s, 0.0);
  EXPECT_DOUBLE_EQ(series.points.back().t_s, core::to_seconds(kImuStep * kStatesEvery * (kStates - 1)));
  const PoseError& last = series.points.back().error;
  EXPECT_LT((last.position_m - error_.segment<3>(8)).norm(), 1e-12);
  EXPECT_LT((last.rotation_rad - error_.segment<3>(11)).norm(), 1e-12);
  EXPECT_LT((series.points.back().aligned.p - series.points.back().truth.p - last.position_m).norm(), 1e-15);
  ASSERT_EQ(series.td.size(), static_cast<std::size_t>(kSeriesPoints));
  EXPECT_NEAR(series.td.back().td_error_s, 1e-3, 1e-15);

  const nlohmann::ordered_json json = to_json(series);
  EXPECT_EQ(json.at("t_s").size(), series.points.size());
  EXPECT_EQ(json.at("position_error_m").size(), 3U);
  EXPECT_EQ(json.at("estimate").size(), 7U);
  EXPECT_EQ(json.at("truth").at(6).at(10), series.points[10].truth.q.w());
  EXPECT_EQ(json.at("td").at("sigma_s").at(0), 2e-3);
}

TEST_F(Evaluate, OnlineNeesIsUnalignedAndPerBlock) {
  core::StateTangent e;
  e.setLinSpaced(-1e-3, 2e-3);
  const core::StateCovariance P = estimate_.covariance.block<15, 15>(core::kCovLastState, core::kCovLastState);
  for (const std::size_t k : {400U, 800U}) {
    const auto& [t_ns, x] = truth_.states[k];
    estimate_.state_history.push_back({t_ns, core::plus(x, e), P});
  }
  const TrialResult result = evaluate(Alignment::kSe3);
  ASSERT_EQ(result.series.online.size(), 2U);
  const auto expected = [&](int offset, int dof) {
    return e.segment(offset, dof).dot(P.block(offset, offset, dof, dof).ldlt().solve(e.segment(offset, dof)));
  };
  const OnlinePoint& point = result.series.online[1];
  EXPECT_DOUBLE_EQ(point.t_s, 4.0);
  EXPECT_NEAR(point.position_nees / expected(0, 3), 1.0, 1e-6);
  EXPECT_NEAR(point.orientation_nees / expected(3, 3), 1.0, 1e-6);
  EXPECT_NEAR(point.pose_nees / expected(0, 6), 1.0, 1e-6);
  EXPECT_NEAR(point.velocity_nees / expected(6, 3), 1.0, 1e-6);
  EXPECT_NEAR(point.bias_nees / expected(9, 6), 1.0, 1e-6);
  EXPECT_DOUBLE_EQ(point.position_sigma_m.z(), std::sqrt(P(2, 2)));
  EXPECT_DOUBLE_EQ(point.orientation_sigma_rad.x(), std::sqrt(P(3, 3)));
  const auto json = to_json(result.series);
  EXPECT_EQ(json.at("nees").at("pose").size(), 2U);
  EXPECT_EQ(json.at("sigma").at("rotation_rad").at(2).at(1), point.orientation_sigma_rad.z());
  estimate_.state_history[0].covariance.setZero();
  const std::string stamp = std::to_string(estimate_.state_history[0].t_ns);
  expect_unusable("the online covariance at " + stamp + " ns is singular or indefinite");
}

TEST(Series, AGridOfFewStampsTakesEachOnce) {
  EXPECT_EQ(grid_indices({}), std::vector<int>());
  EXPECT_EQ(grid_indices({5}), std::vector<int>({0}));
  EXPECT_EQ(grid_indices({0, 10, 20, 30}), std::vector<int>({0, 1, 2, 3}));
  EXPECT_EQ(grid_indices({0, 1, 3, 98, 99, 100}, 3), std::vector<int>({0, 2, 5}));
}

}  // namespace
}  // namespace plumbline::eval
