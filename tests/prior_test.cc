#include "sim/prior.h"

#include <cmath>
#include <cstdint>
#include <optional>
#include <tuple>
#include <vector>

#include <gtest/gtest.h>

namespace plumbline::sim {
namespace {

constexpr int kDof = core::kStateDof + 8;
using Error = Eigen::Matrix<double, kDof, 1>;

GroundTruth some_truth() {
  GroundTruth truth;
  truth.calibration = {.T_B_C = {core::exp_quaternion(Eigen::Vector3d(1.0, -1.2, 0.6)), {0.06, 0.02, -0.01}},
                       .td_s = 0.02,
                       .readout_s = 0.03};
  truth.states.push_back({.t_ns = 5'000'000,
                          .state = {.T_W_B = {core::exp_quaternion(Eigen::Vector3d(0.4, -1.1, 0.7)), {1.0, -2.0, 0.5}},
                                    .v_W = {0.3, 0.2, -0.1},
                                    .bias = {{0.01, -0.02, 0.03}, {0.1, 0.2, -0.3}}}});
  return truth;
}

Error error_of(const core::State& state, const core::RigCalibration& calibration, const GroundTruth& truth) {
  Error e;
  e << core::minus(state, truth.states.front().state), calibration.T_B_C.p - truth.calibration.T_B_C.p,
      core::log_so3(Eigen::Quaterniond(truth.calibration.T_B_C.q.conjugate() * calibration.T_B_C.q)),
      calibration.td_s - truth.calibration.td_s, calibration.readout_s - truth.calibration.readout_s;
  return e;
}

Error sigmas(const core::InitialPrior& prior) {
  const core::CalibrationSigmas& c = prior.calibration_sigma;
  Error s;
  s << prior.sigma.per_axis(), Eigen::Vector3d::Constant(c.extrinsic_position_m),
      Eigen::Vector3d::Constant(c.extrinsic_rotation_rad), c.td_s, c.readout_s;
  return s;
}

// All different, so that no two can be exchanged.
ScenarioConfig some_config() {
  ScenarioConfig config;
  config.prior.position_sigma_m = 0.01;
  config.prior.orientation_sigma_rad = 0.02;
  config.prior.velocity_sigma_m_s = 0.05;
  config.prior.gyro_bias_sigma_rad_s = 0.003;
  config.prior.accel_bias_sigma_m_s2 = 0.07;
  config.prior.extrinsic_position_sigma_m = 0.04;
  config.prior.extrinsic_rotation_sigma_rad = 0.015;
  config.prior.td_sigma_s = 0.008;
  config.prior.readout_sigma_s = 0.004;
  return config;
}

// The standard score of a chi-square variable, by Wilson and Hilferty.
double chi_square_score(double x, double dof) {
  return (std::cbrt(x / dof) - 1.0 + 2.0 / (9.0 * dof)) / std::sqrt(2.0 / (9.0 * dof));
}

// |score| < 4.5 is exceeded by chance in 7e-6 of cases.
constexpr double kLargestScore = 4.5;

void expect_unit_normals(const std::vector<Error>& whitened) {
  const auto n = static_cast<double>(whitened.size());
  Error mean = Error::Zero();
  Eigen::Matrix<double, kDof, kDof> product = Eigen::Matrix<double, kDof, kDof>::Zero();
  for (const Error& e : whitened) {
    mean += e / n;
    product += e * e.transpose();
  }
  for (int i = 0; i < kDof; ++i) {
    EXPECT_LT(std::abs(mean[i]) * std::sqrt(n), kLargestScore) << i;
    EXPECT_LT(std::abs(chi_square_score(product(i, i), n)), kLargestScore) << i;
    for (int j = 0; j < i; ++j) EXPECT_LT(std::abs(product(i, j)) / std::sqrt(n), kLargestScore) << i << ' ' << j;
  }
  EXPECT_LT(std::abs(chi_square_score(product.trace(), n * kDof)), kLargestScore);
}

TEST(Prior, DrawsHaveTheStatedCovariance) {
  const GroundTruth truth = some_truth();
  ScenarioConfig config = some_config();
  config.prior.start = PriorStart::kDrawn;
  std::vector<Error> means;
  std::vector<Error> starts;
  std::vector<Error> sums;
  for (std::uint64_t trial = 0; trial < 2000; ++trial) {
    const core::InitialPrior prior = make_prior(truth, config, {.seed = 1, .trial = trial});
    means.push_back(error_of(prior.mean, prior.calibration, truth).cwiseQuotient(sigmas(prior)));
    starts.push_back(error_of(prior.start, prior.start_calibration, truth).cwiseQuotient(sigmas(prior)));
    sums.emplace_back((means.back() + starts.back()) / std::sqrt(2.0));
  }
  expect_unit_normals(means);
  expect_unit_normals(starts);
  expect_unit_normals(sums);  // mean and start are independent
}

TEST(Prior, StatesTheConfiguredSigmas) {
  const core::InitialPrior prior = make_prior(some_truth(), some_config(), {.seed = 1, .trial = 0});
  EXPECT_EQ(prior.t_ns, 5'000'000);
  Error expected;
  expected << Eigen::Vector3d::Constant(0.01), Eigen::Vector3d::Constant(0.02), Eigen::Vector3d::Constant(0.05),
      Eigen::Vector3d::Constant(0.003), Eigen::Vector3d::Constant(0.07), Eigen::Vector3d::Constant(0.04),
      Eigen::Vector3d::Constant(0.015), 0.008, 0.004;
  EXPECT_EQ(sigmas(prior), expected);
}

TEST(Prior, MeansAtTheTruthAreExact) {
  const GroundTruth truth = some_truth();
  ScenarioConfig config = some_config();
  config.prior.means = PriorMeans::kTruth;
  const core::InitialPrior prior = make_prior(truth, config, {.seed = 1, .trial = 0});
  EXPECT_EQ(error_of(prior.mean, prior.calibration, truth), Error::Zero());
  EXPECT_EQ(error_of(prior.start, prior.start_calibration, truth), Error::Zero());
  EXPECT_GT(sigmas(prior).minCoeff(), 0.0);

  config.prior.start = PriorStart::kDrawn;
  const core::InitialPrior drawn = make_prior(truth, config, {.seed = 1, .trial = 0});
  EXPECT_EQ(error_of(drawn.mean, drawn.calibration, truth), Error::Zero());
  EXPECT_GT(error_of(drawn.start, drawn.start_calibration, truth).cwiseAbs().minCoeff(), 0.0);
}

TEST(Prior, StartIsTheMeanUnlessDrawn) {
  const GroundTruth truth = some_truth();
  ScenarioConfig config = some_config();
  const core::InitialPrior at_mean = make_prior(truth, config, {.seed = 1, .trial = 0});
  EXPECT_EQ(error_of(at_mean.start, at_mean.start_calibration, truth),
            error_of(at_mean.mean, at_mean.calibration, truth));

  config.prior.start = PriorStart::kDrawn;
  const core::InitialPrior drawn = make_prior(truth, config, {.seed = 1, .trial = 0});
  const Error mean = error_of(drawn.mean, drawn.calibration, truth);
  EXPECT_EQ(mean, error_of(at_mean.mean, at_mean.calibration, truth));
  EXPECT_GT((error_of(drawn.start, drawn.start_calibration, truth) - mean).cwiseAbs().minCoeff(), 0.0);
}

TEST(Prior, DrawsTheCameraAndLeavesTheOtherDraws) {
  GroundTruth truth = some_truth();
  const ScenarioConfig known = some_config();
  ScenarioConfig config = known;
  config.prior.focal_sigma_px = 4.0;
  config.prior.principal_point_sigma_px = 3.0;
  EXPECT_FALSE(known.calibration().intrinsics);
  truth.calibration.intrinsics = config.calibration().intrinsics;
  const core::Intrinsics sigma(4.0, 4.0, 3.0, 3.0);
  constexpr int kTrials = 2000;
  Eigen::Matrix4d product = Eigen::Matrix4d::Zero();
  for (std::uint64_t trial = 0; trial < kTrials; ++trial) {
    const core::InitialPrior prior = make_prior(truth, config, {.seed = 1, .trial = trial});
    const core::Intrinsics e = (*prior.calibration.intrinsics - *truth.calibration.intrinsics).cwiseQuotient(sigma);
    product += e * e.transpose();
    if (trial > 3) continue;
    const core::InitialPrior without = make_prior(some_truth(), known, {.seed = 1, .trial = trial});
    EXPECT_FALSE(without.calibration.intrinsics);
    EXPECT_EQ(error_of(prior.mean, prior.calibration, truth), error_of(without.mean, without.calibration, truth));
  }
  for (int i = 0; i < 4; ++i) {
    EXPECT_LT(std::abs(chi_square_score(product(i, i), kTrials)), kLargestScore) << i;
    for (int j = 0; j < i; ++j) EXPECT_LT(std::abs(product(i, j)) / std::sqrt(kTrials), kLargestScore) << i << ' ' << j;
  }
}

// Of td and the readout, each alone.
TEST(Prior, AFixedMeanLeavesTheOtherDraws) {
  const GroundTruth truth = some_truth();
  const core::InitialPrior drawn = make_prior(truth, some_config(), {.seed = 1, .trial = 3});
  using Mean = std::optional<double> PriorConfig::*;
  using Value = double core::RigCalibration::*;
  for (const auto& [mean, value, other] :
       {std::tuple<Mean, Value, Value>{&PriorConfig::td_mean_s, &core::RigCalibration::td_s,
                                       &core::RigCalibration::readout_s},
        {&PriorConfig::readout_mean_s, &core::RigCalibration::readout_s, &core::RigCalibration::td_s}}) {
    ScenarioConfig config = some_config();
    config.prior.*mean = 0.1;
    const core::InitialPrior fixed = make_prior(truth, config, {.seed = 1, .trial = 3});
    EXPECT_NE(drawn.calibration.*value, 0.1);
    EXPECT_EQ(fixed.calibration.*value, 0.1);
    EXPECT_EQ(fixed.start_calibration.*value, 0.1);
    EXPECT_EQ(make_prior(truth, config, {.seed = 1, .trial = 4}).calibration.*value, 0.1);
    EXPECT_EQ(core::minus(fixed.mean, drawn.mean), core::StateTangent::Zero());
    EXPECT_EQ(fixed.calibration.*other, drawn.calibration.*other);
    EXPECT_EQ(fixed.calibration.T_B_C.p, drawn.calibration.T_B_C.p);
    EXPECT_EQ(fixed.calibration.T_B_C.q.coeffs(), drawn.calibration.T_B_C.q.coeffs());
  }
}

}  // namespace
}  // namespace plumbline::sim
