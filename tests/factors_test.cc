// Inertial, point and prior factors: laws of tests/factor_laws.h, hand-worked vectors, and statistics.
#include <array>
#include <cmath>
#include <memory>

#include <gtest/gtest.h>

#include "core/random.h"
#include "estimator/factors/imu_factor.h"
#include "estimator/factors/local_motion.h"
#include "estimator/factors/point_factors.h"
#include "estimator/factors/prior_factors.h"
#include "factor_laws.h"

namespace plumbline::estimator {
namespace {

using core::ImuBias;
using core::ImuSample;
using core::State;
using testing::Block;
using testing::block;

constexpr double kGravity = 9.81;
const core::ImuNoise kNoise{1.7e-4, 2e-5, 2e-3, 3e-3};
const StateManifold kStateManifold;
const PoseManifold kPoseManifold;
const core::RandomStream kRandom({7, 0}, "factors_test");

State random_state(std::uint64_t i) {
  return {.T_W_B = {core::exp_quaternion(kRandom.normal3(i, 0)), kRandom.normal3(i, 1)},
          .v_W = kRandom.normal3(i, 2),
          .bias = {0.02 * kRandom.normal3(i, 3), 0.1 * kRandom.normal3(i, 4)}};
}

// Lively samples about rest: rates of 1 rad/s, accelerations of 2 m/s^2.
std::vector<ImuSample> random_samples(int count, double dt_s, std::uint64_t seed) {
  std::vector<ImuSample> samples;
  for (int k = 0; k < count; ++k) {
    const double t = k * dt_s;
    const Eigen::Vector3d phase = kRandom.normal3(1000 + seed, 0);
    const Eigen::Vector3d gyro = (phase.array() + 3.0 * t * Eigen::Array3d(1.0, 1.3, 0.7)).sin();
    const Eigen::Vector3d accel = 2.0 * (phase.array() - 2.0 * t * Eigen::Array3d(0.8, 1.1, 1.7)).cos();
    samples.push_back({core::to_ns(t), gyro, accel + Eigen::Vector3d(0.0, 0.0, kGravity)});
  }
  return samples;
}

TEST(ImuFactor, JacobiansMatchRiddersAtRandomStates) {
  for (std::uint64_t i = 0; i < 5; ++i) {
    const auto samples = random_samples(21, 0.005, i);
    const Preintegration preintegration = preintegrate(samples, {}, kNoise);
    const ImuFactor factor(preintegration, kGravity);
    const std::vector<Block> blocks = {block(pack(random_state(2 * i)), &kStateManifold),
                                       block(pack(random_state(2 * i + 1)), &kStateManifold)};
    // Ridders reaches about 1e-10; whitened entries span ten orders, so what is small is judged against the largest.
    for (std::size_t k = 0; k < 2; ++k) testing::expect_jacobian(factor, blocks, k, 0.02, 1e-7);
  }
}

TEST(ImuFactor, VanishesAtTheCarriedState) {
  const auto samples = random_samples(21, 0.005, 3);
  const State from = random_state(1);
  const State to = carry(from, samples, 0, 20, kGravity);
  const ImuFactor factor(preintegrate(samples, from.bias, kNoise), kGravity);
  const Eigen::VectorXd r =
      testing::residual(factor, {block(pack(from), &kStateManifold), block(pack(to), &kStateManifold)});
  EXPECT_LT(r.cwiseAbs().maxCoeff(), 1e-8);  // rounding, whitened by 1e5
}

TEST(ImuFactor, DoesNotSeeYawNorPlace) {
  const auto samples = random_samples(21, 0.005, 4);
  const ImuFactor factor(preintegrate(samples, {}, kNoise), kGravity);
  const core::Pose moved{core::exp_quaternion(Eigen::Vector3d(0, 0, 1.2)), {3, -2, 5}};
  std::array<State, 2> states = {random_state(5), random_state(6)};
  const auto evaluate = [&] {
    return testing::residual(factor,
                             {block(pack(states[0]), &kStateManifold), block(pack(states[1]), &kStateManifold)});
  };
  const Eigen::VectorXd before = evaluate();
  for (State& s : states) {
    s.T_W_B = moved * s.T_W_B;
    s.v_W = moved.q * s.v_W;
  }
  EXPECT_LT((evaluate() - before).norm() / before.norm(), 1e-12);
  // A tilt is seen: gravity has a direction.
  for (State& s : states) s.T_W_B.q = core::exp_quaternion(Eigen::Vector3d(0.01, 0, 0)) * s.T_W_B.q;
  EXPECT_GT((evaluate() - before).norm(), 1.0);
}

TEST(ImuFactor, FreeFallNeedsGravityDownwards) {
  // A body at rest reads +g; with the sign flipped it would be thought to fall at 2 g.
  std::vector<ImuSample> rest;
  for (int i = 0; i <= 20; ++i) rest.push_back({core::to_ns(0.005 * i), {0, 0, 0}, {0, 0, kGravity}});
  const State after = carry(State{}, rest, 0, 20, kGravity);
  EXPECT_LT(after.T_W_B.p.norm(), 1e-14);
  EXPECT_LT(after.v_W.norm(), 1e-14);
}

TEST(Preintegration, BiasJacobiansMatchReintegration) {
  const auto samples = random_samples(21, 0.005, 8);
  const ImuBias bias{{0.01, -0.02, 0.015}, {0.1, -0.05, 0.2}};
  const Preintegration base = preintegrate(samples, bias, kNoise);
  const double h = 1e-5;
  for (int axis = 0; axis < 3; ++axis) {
    ImuBias plus = bias;
    ImuBias minus = bias;
    plus.gyro_rad_s[axis] += h;
    minus.gyro_rad_s[axis] -= h;
    const ImuIncrement p = preintegrate(samples, plus, kNoise).increment;
    const ImuIncrement m = preintegrate(samples, minus, kNoise).increment;
    const ImuIncrement& x = base.increment;
    const Eigen::Vector3d R_bg = core::log_so3(Eigen::Quaterniond(Eigen::Matrix3d(m.R.transpose() * p.R))) / (2.0 * h);
    // Central differences leave h^2 and rounding/h: 1e-10 of the step's effect.
    EXPECT_LT((x.R_bg.col(axis) - R_bg).norm(), 1e-9);
    EXPECT_LT((x.v_bg.col(axis) - (p.v - m.v) / (2.0 * h)).norm(), 1e-9);
    EXPECT_LT((x.p_bg.col(axis) - (p.p - m.p) / (2.0 * h)).norm(), 1e-9);
    plus = minus = bias;
    plus.accel_m_s2[axis] += h;
    minus.accel_m_s2[axis] -= h;
    const ImuIncrement pa = preintegrate(samples, plus, kNoise).increment;
    const ImuIncrement ma = preintegrate(samples, minus, kNoise).increment;
    EXPECT_LT((x.v_ba.col(axis) - (pa.v - ma.v) / (2.0 * h)).norm(), 1e-9);
    EXPECT_LT((x.p_ba.col(axis) - (pa.p - ma.p) / (2.0 * h)).norm(), 1e-9);
  }
}

// Adds white noise and a walking bias to the samples and compares the whitened residuals of the factor at the true
// states with N(0, I): their mean square over 15 * trials numbers.
TEST(Preintegration, MonteCarloCovarianceEqualsThePropagatedOne) {
  constexpr int kTrials = 1500;
  const double dt = 0.005;
  const auto clean = random_samples(41, dt, 9);
  const State from = random_state(3);
  std::vector<ImuSample> ideal = clean;
  for (ImuSample& s : ideal) {
    s.gyro_rad_s += from.bias.gyro_rad_s;
    s.accel_m_s2 += from.bias.accel_m_s2;
  }
  const State to = carry(from, ideal, 0, ideal.size() - 1, kGravity);
  Eigen::Matrix<double, 15, 15> covariance = Eigen::Matrix<double, 15, 15>::Zero();
  for (int trial = 0; trial < kTrials; ++trial) {
    const core::RandomStream noise({11, static_cast<std::uint64_t>(trial)}, "noise");
    std::vector<ImuSample> noisy = ideal;
    ImuBias walk;
    for (std::size_t i = 0; i < noisy.size(); ++i) {
      noisy[i].gyro_rad_s += walk.gyro_rad_s + kNoise.gyro_noise_density / std::sqrt(dt) * noise.normal3(i, 0);
      noisy[i].accel_m_s2 += walk.accel_m_s2 + kNoise.accel_noise_density / std::sqrt(dt) * noise.normal3(i, 1);
      if (i + 1 == noisy.size()) break;
      walk.gyro_rad_s += kNoise.gyro_bias_walk * std::sqrt(dt) * noise.normal3(i, 2);
      walk.accel_m_s2 += kNoise.accel_bias_walk * std::sqrt(dt) * noise.normal3(i, 3);
    }
    State truth = to;
    truth.bias.gyro_rad_s += walk.gyro_rad_s;
    truth.bias.accel_m_s2 += walk.accel_m_s2;
    const ImuFactor factor(preintegrate(noisy, from.bias, kNoise), kGravity);
    const Eigen::VectorXd r =
        testing::residual(factor, {block(pack(from), &kStateManifold), block(pack(truth), &kStateManifold)});
    covariance += r * r.transpose() / kTrials;
  }
  // Each diagonal entry is chi2(1500)/1500: standard deviation sqrt(2/1500) = 3.7 %. Both ends of a midpoint step share
  // its noise, so that the sum holds N - 1/2 noises of N: -1.25 %. Four sigma and that: 16 %.
  for (int i = 0; i < 15; ++i) EXPECT_NEAR(covariance(i, i), 1.0, 0.16) << i;
  // Off the diagonal: 1/sqrt(1500) = 2.6 %, 105 entries: 4.5 sigma.
  for (int i = 0; i < 15; ++i) {
    for (int j = 0; j < i; ++j) EXPECT_NEAR(covariance(i, j), 0.0, 0.12) << i << " " << j;
  }
}

TEST(Preintegration, RefusesWhatItCannotWeigh) {
  const auto samples = random_samples(3, 0.005, 1);
  EXPECT_THROW(preintegrate(std::span(samples).first(1), {}, kNoise), std::invalid_argument);
  EXPECT_THROW(preintegrate(samples, {}, core::ImuNoise{}), std::invalid_argument);
}

TEST(Carry, BackwardIsTheInverseOfForward) {
  const auto samples = random_samples(21, 0.005, 2);
  const State start = random_state(9);
  const State back = carry(carry(start, samples, 4, 17, kGravity), samples, 17, 4, kGravity);
  EXPECT_LT(core::minus(back, start).norm(), 1e-13);
}

// ---- local motion and points

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
    ASSERT_TRUE(body_at(motion, state, kGravity, 0.005 * offset, body));
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

// One observation at random but sensible geometry: a landmark a few metres ahead of two cameras that face it.
struct PointScene {
  CameraModel model;
  core::Pose T_B_C{Eigen::Quaterniond(0.5, -0.5, 0.5, -0.5), {0.06, 0.02, -0.01}};
  double td = 0.013;
  double readout = 0.03;
  State anchor;
  State observer;
  std::shared_ptr<LocalMotion> motion_a;
  std::shared_ptr<LocalMotion> motion_b;
  double offset_a = -0.011;
  double offset_b = -0.0155;
  Eigen::Vector3d landmark;
  Eigen::Vector2d pixel;

  explicit PointScene(std::uint64_t i) {
    const auto small = [&](std::uint64_t sub, double scale) -> Eigen::Vector3d {
      return scale * kRandom.normal3(i, sub);
    };
    anchor = {.T_W_B = {core::exp_quaternion(small(20, 0.1)), small(21, 0.2)},
              .v_W = small(22, 0.7),
              .bias = {small(23, 0.02), small(24, 0.1)}};
    observer = {.T_W_B = {core::exp_quaternion(small(25, 0.1)), small(26, 0.2)},
                .v_W = small(27, 0.7),
                .bias = {small(28, 0.02), small(29, 0.1)}};
    // Tables at other biases than the states': the first-order correction takes part.
    motion_a = local_motion(100 + i, ImuBias{small(23, 0.019), small(24, 0.09)});
    motion_b = local_motion(200 + i, ImuBias{small(28, 0.019), small(29, 0.09)});
    landmark = {0.2 * kRandom.normal(i, 30), 0.2 * kRandom.normal(i, 31), 0.1 + 0.3 * kRandom.uniform(i, 32)};
    pixel = {319.5 + 100.0 * kRandom.normal(i, 33), 239.5 + 80.0 * kRandom.normal(i, 34)};
  }

  PropagatedPointFactor factor() const { return {model, {motion_a, offset_a}, {motion_b, offset_b}, pixel}; }
  std::vector<Block> blocks() const {
    return {block(pack(anchor), &kStateManifold),
            block(pack(observer), &kStateManifold),
            block(pack(T_B_C), &kPoseManifold),
            {{td}, nullptr},
            {{readout}, nullptr},
            block(landmark)};
  }
};

TEST(PropagatedPointFactor, JacobiansMatchRiddersAtRandomStates) {
  int tested = 0;
  for (std::uint64_t i = 0; tested < 20; ++i) {
    const PointScene scene(i);
    const PropagatedPointFactor factor = scene.factor();
    const std::vector<Block> blocks = scene.blocks();
    Eigen::Vector2d r;
    if (!factor.Evaluate(testing::pointers(blocks).data(), r.data(), nullptr)) continue;  // behind the observer
    ++tested;
    // Time crosses the steps of the IMU's samples within 2.5 ms, where the third derivative jumps: small steps there.
    // For the same reason the biases are moved little, since they move the row and so the time.
    for (const std::size_t k : {0U, 1U}) testing::expect_jacobian(factor, blocks, k, 1e-3, 2e-7);
    testing::expect_jacobian(factor, blocks, 2, 1e-3, 2e-7);
    testing::expect_jacobian(factor, blocks, 3, 2e-5, 2e-7);
    testing::expect_jacobian(factor, blocks, 4, 2e-5, 2e-7);
    testing::expect_jacobian(factor, blocks, 5, 1e-4, 2e-7);
  }
}

TEST(PropagatedPointFactor, GlobalShutterHasNoReadoutPathToTheRow) {
  PointScene scene(2);
  scene.readout = 0.0;
  const PropagatedPointFactor factor = scene.factor();
  for (std::size_t k = 0; k < 6; ++k) {
    testing::expect_jacobian(factor, scene.blocks(), k, k == 3 ? 2e-5 : (k == 4 ? 1e-4 : 1e-3), 1e-6);
  }
}

// The row is the predicted one: noise in the measured row moves the residual by exactly as much and nothing else.
TEST(PropagatedPointFactor, TheMeasuredRowIsNotATime) {
  PointScene scene(3);
  const Eigen::VectorXd before = testing::residual(scene.factor(), scene.blocks());
  scene.pixel.y() += 3.0;
  const Eigen::VectorXd after = testing::residual(scene.factor(), scene.blocks());
  EXPECT_NEAR(after.x(), before.x(), 1e-9);
  EXPECT_NEAR(after.y(), before.y() - 3.0 / scene.model.pixel_sigma_px, 1e-9);
}

// Without motion the formula is MATH.md's test vector A: q = (1, 1, 4), r = (-0.05, 0.05) on the normalised plane.
TEST(PropagatedPointFactor, HandWorkedVector) {
  CameraModel model;
  model.camera = {.width_px = 640, .height_px = 480, .fx_px = 1.0, .fy_px = 1.0, .cx_px = 0.0, .cy_px = 0.0};
  std::vector<ImuSample> rest;
  for (int i = 0; i <= 20; ++i) rest.push_back({core::to_ns(0.005 * i), {0, 0, 0}, {0, 0, kGravity}});
  const auto motion = std::make_shared<LocalMotion>(rest, 10, 0.05, ImuBias{});
  const PropagatedPointFactor factor(model, {motion, 0.0}, {motion, 0.0}, {0.3, 0.2});
  State observer;
  observer.T_W_B.p = {1, 0, 0};
  const std::vector<Block> blocks = {block(pack(State{}), &kStateManifold),
                                     block(pack(observer), &kStateManifold),
                                     block(pack(core::Pose{}), &kPoseManifold),
                                     {{0.0}, nullptr},
                                     {{0.0}, nullptr},
                                     {{0.5, 0.25, 0.25}, nullptr}};
  const Eigen::VectorXd r = testing::residual(factor, blocks);
  EXPECT_NEAR(r.x(), -0.05, 1e-14);
  EXPECT_NEAR(r.y(), 0.05, 1e-14);
  const Eigen::MatrixXd J = testing::tangent_jacobian(factor, blocks, 5);
  EXPECT_NEAR(J(0, 2), -1.0, 1e-14);
  EXPECT_NEAR(J(1, 2), 0.0, 1e-14);
}

TEST(PropagatedPointFactor, BehindTheObserverIsFalseAndInfinityIsNot) {
  PointScene scene(2);
  const auto evaluates = [&] {
    const std::vector<Block> blocks = scene.blocks();
    Eigen::Vector2d r;
    return scene.factor().Evaluate(testing::pointers(blocks).data(), r.data(), nullptr) && r.allFinite();
  };
  scene.landmark.z() = 0.0;
  EXPECT_TRUE(evaluates());
  scene.landmark.z() = -1e-3;
  EXPECT_TRUE(evaluates());
  scene.observer.T_W_B.q = scene.observer.T_W_B.q * core::exp_quaternion(Eigen::Vector3d(0, 0, 3.0));
  EXPECT_FALSE(evaluates());
}

TEST(PropagatedPointFactor, LeavingTheTableIsFalse) {
  PointScene scene(2);
  scene.td = 0.5;
  const std::vector<Block> blocks = scene.blocks();
  Eigen::Vector2d r;
  EXPECT_FALSE(scene.factor().Evaluate(testing::pointers(blocks).data(), r.data(), nullptr));
}

TEST(AnchorPointFactor, LawsAndWhitening) {
  CameraModel model;
  model.pixel_sigma_px = 0.5;
  const AnchorPointFactor factor(model, {300.0, 200.0});
  const std::vector<Block> blocks = {{{0.1, -0.2, 0.3}, nullptr}};
  const Eigen::VectorXd r = testing::residual(factor, blocks);
  EXPECT_NEAR(r.x(), (460.0 * 0.1 + 319.5 - 300.0) / 0.5, 1e-12);
  EXPECT_NEAR(r.y(), (-460.0 * 0.2 + 239.5 - 200.0) / 0.5, 1e-12);
  testing::expect_jacobian(factor, blocks, 0, 0.01, 1e-9);
}

TEST(PriorFactors, LawsAndExactWhitening) {
  const State truth = random_state(1);
  const core::StateSigmas sigma{0.01, 0.02, 0.05, 0.005, 0.1};
  core::StateTangent n;
  for (int i = 0; i < 5; ++i) n.segment<3>(3 * i) = kRandom.normal3(400, static_cast<std::uint64_t>(i));
  const State mean = core::plus(truth, n.cwiseProduct(sigma.per_axis()));
  const StatePriorFactor state_prior(mean, sigma);
  const std::vector<Block> at_truth = {block(pack(truth), &kStateManifold)};
  EXPECT_LT((testing::residual(state_prior, at_truth) - n).norm(), 1e-10);
  testing::expect_jacobian(state_prior, at_truth, 0, 0.01, 1e-8);

  const core::Pose T{core::exp_quaternion(kRandom.normal3(401)), kRandom.normal3(402)};
  const core::Pose other{T.q * core::exp_quaternion(0.3 * kRandom.normal3(403)), kRandom.normal3(404)};
  testing::expect_jacobian(ExtrinsicsPriorFactor(other, 0.02, 0.03), {block(pack(T), &kPoseManifold)}, 0, 0.01, 1e-8);
  const ScalarPriorFactor scalar(0.02, 0.005);
  EXPECT_NEAR(testing::residual(scalar, {{{0.01}, nullptr}})[0], 2.0, 1e-12);
  testing::expect_jacobian(scalar, {{{0.01}, nullptr}}, 0, 0.01, 1e-9);
}

}  // namespace
}  // namespace plumbline::estimator
