// Inertial and prior factors: the laws of tests/factor_laws.h, statistics of the preintegration, and local motion.
#include <memory>
#include <span>
#include <stdexcept>

#include <gtest/gtest.h>

#include "core/random.h"
#include "estimator/factors/imu_factor.h"
#include "estimator/factors/local_motion.h"
#include "estimator/factors/prior_factors.h"
#include "estimator/factors/timed_body.h"
#include "factor_laws.h"
#include "imu_subjects.h"
#include "prior_subjects.h"
#include "rig_blocks.h"

namespace plumbline::estimator {
namespace {

using core::ImuBias;
using core::ImuSample;
using core::State;
using testing::Block;
using testing::FactorScene;
using testing::imu_scene;
using testing::kGravity;
using testing::kImuNoise;
using testing::kStateRandom;
using testing::random_samples;
using testing::random_state;
using testing::samples_at_rest;
using testing::state_block;

TEST(ImuFactor, SeesATilt) {
  FactorScene s = imu_scene({.scene = 3});
  const core::Pose tilted{.q = core::exp_quaternion(Eigen::Vector3d(0.01, 0.0, 0.0))};
  for (Block& b : s.blocks) testing::move_state(tilted, b);
  EXPECT_GT(testing::residual(*s.factor, s.blocks).norm(), 1.0);  // gravity has a direction
}

TEST(ImuFactor, FreeFallNeedsGravityDownwards) {
  // A body at rest reads +g; with the sign flipped it would be thought to fall at 2 g.
  const State after = carry(State{}, samples_at_rest(21, 0.005), 0, 20, kGravity);
  EXPECT_LT(after.T_W_B.p.norm(), 1e-14);
  EXPECT_LT(after.v_W.norm(), 1e-14);
}

TEST(Preintegration, BiasJacobiansMatchReintegration) {
  const auto samples = random_samples(21, 0.005, 8);
  const ImuBias bias{{0.01, -0.02, 0.015}, {0.1, -0.05, 0.2}};
  const Preintegration base = preintegrate(samples, bias, kImuNoise);
  const double h = 1e-5;
  for (int axis = 0; axis < 3; ++axis) {
    ImuBias plus = bias;
    ImuBias minus = bias;
    plus.gyro_rad_s[axis] += h;
    minus.gyro_rad_s[axis] -= h;
    const ImuIncrement p = preintegrate(samples, plus, kImuNoise).increment;
    const ImuIncrement m = preintegrate(samples, minus, kImuNoise).increment;
    const ImuIncrement& x = base.increment;
    const Eigen::Vector3d R_bg = core::log_so3(Eigen::Quaterniond(Eigen::Matrix3d(m.R.transpose() * p.R))) / (2.0 * h);
    // Central differences leave h^2 and rounding/h: 1e-10 of the step's effect.
    EXPECT_LT((x.R_bg.col(axis) - R_bg).norm(), 1e-9);
    EXPECT_LT((x.v_bg.col(axis) - (p.v - m.v) / (2.0 * h)).norm(), 1e-9);
    EXPECT_LT((x.p_bg.col(axis) - (p.p - m.p) / (2.0 * h)).norm(), 1e-9);
    plus = minus = bias;
    plus.accel_m_s2[axis] += h;
    minus.accel_m_s2[axis] -= h;
    const ImuIncrement pa = preintegrate(samples, plus, kImuNoise).increment;
    const ImuIncrement ma = preintegrate(samples, minus, kImuNoise).increment;
    EXPECT_LT((x.v_ba.col(axis) - (pa.v - ma.v) / (2.0 * h)).norm(), 1e-9);
    EXPECT_LT((x.p_ba.col(axis) - (pa.p - ma.p) / (2.0 * h)).norm(), 1e-9);
  }
}

TEST(Preintegration, RefusesWhatItCannotWeigh) {
  const auto samples = random_samples(3, 0.005, 1);
  EXPECT_THROW(preintegrate(std::span(samples).first(1), {}, kImuNoise), std::invalid_argument);
  EXPECT_THROW(preintegrate(samples, {}, core::ImuNoise{}), std::invalid_argument);
}

TEST(Carry, BackwardIsTheInverseOfForward) {
  const auto samples = random_samples(21, 0.005, 2);
  const State start = random_state(9);
  const State back = carry(carry(start, samples, 4, 17, kGravity), samples, 17, 4, kGravity);
  EXPECT_LT(core::minus(back, start).norm(), 1e-13);
}

// ---- local motion

constexpr std::size_t kMiddle = 30;

std::shared_ptr<LocalMotion> local_motion(std::uint64_t seed, const ImuBias& bias) {
  return std::make_shared<LocalMotion>(random_samples(61, 0.005, seed), kMiddle, 0.1, bias);
}

TEST(LocalMotion, MeetsTheCarriedStatesAtTheSamples) {
  const auto samples = random_samples(61, 0.005, 5);
  const State state = random_state(4);
  const LocalMotion motion(samples, kMiddle, 0.1, state.bias);
  for (const int offset : {-20, -7, -1, 0, 1, 6, 20}) {
    const State carried = carry(state, samples, kMiddle, kMiddle + static_cast<std::size_t>(offset), kGravity);
    TimedBody body;
    ASSERT_TRUE(BodyPath(motion, state, kGravity).at(0.005 * offset, body));
    EXPECT_LT((body.p - carried.T_W_B.p).norm(), 1e-13) << offset;
    EXPECT_LT((body.R - carried.T_W_B.q.toRotationMatrix()).norm(), 1e-13) << offset;
    // Within a midpoint step dp/dtau is the velocity to second order only: half the jerk times dt^2.
    EXPECT_LT((body.velocity - carried.v_W).norm(), 2e-4) << offset;
  }
  LocalPose pose;
  EXPECT_FALSE(motion.at(0.2, state.bias, pose));
  EXPECT_FALSE(motion.at(-0.2, state.bias, pose));
}

TEST(LocalMotion, RatesAreTheDerivativesOfThePose) {
  const State state = random_state(4);
  const auto motion = local_motion(5, ImuBias{});  // the state's biases differ from the table's
  for (const double tau : {-0.0481, -0.0123, 0.0011, 0.0377}) {
    const double h = 1e-5;
    LocalPose at;
    LocalPose before;
    LocalPose after;
    ASSERT_TRUE(motion->at(tau, state.bias, at) && motion->at(tau - h, state.bias, before) &&
                motion->at(tau + h, state.bias, after));
    // h^2 times third derivatives of about 10, and rounding/h.
    EXPECT_LT((at.p_dot - (after.p - before.p) / (2.0 * h)).norm(), 1e-8);
    const Eigen::Vector3d omega =
        core::log_so3(Eigen::Quaterniond(Eigen::Matrix3d(before.R.transpose() * after.R))) / (2.0 * h);
    EXPECT_LT((at.omega - omega).norm(), 1e-8);
  }
}

TEST(PriorFactors, WhitenExactly) {
  const State truth = random_state(1);
  core::StateTangent n;
  for (int i = 0; i < 5; ++i) n.segment<3>(3 * i) = kStateRandom.normal3(400, static_cast<std::uint64_t>(i));
  const State mean = core::plus(truth, n.cwiseProduct(testing::kStateSigmas.per_axis()));
  const StatePriorFactor state_prior(mean, testing::kStateSigmas);
  EXPECT_LT((testing::residual(state_prior, {state_block(truth)}) - n).norm(), 1e-10);
  const ScalarPriorFactor scalar(0.02, 0.005);
  EXPECT_NEAR(testing::residual(scalar, {testing::scalar_block(0.01)})[0], 2.0, 1e-12);
}

}  // namespace
}  // namespace plumbline::estimator

namespace plumbline::testing {
INSTANTIATE_TEST_SUITE_P(Imu, FactorLaws, ::testing::ValuesIn(imu_subjects()), subject_name);
INSTANTIATE_TEST_SUITE_P(Imu, WorldFrameLaws, ::testing::ValuesIn(in_world(imu_subjects())), subject_name);
INSTANTIATE_TEST_SUITE_P(Priors, FactorLaws, ::testing::ValuesIn(prior_subjects()), subject_name);
INSTANTIATE_TEST_SUITE_P(Priors, WorldFrameLaws, ::testing::ValuesIn(in_world(prior_subjects())), subject_name);
}  // namespace plumbline::testing
