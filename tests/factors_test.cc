// Inertial and prior factors: the laws of tests/factor_laws.h, statistics of the preintegration, and local motion.
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
#include "plain_factors.h"

namespace plumbline::estimator {
namespace {

using core::ImuBias;
using core::ImuSample;
using core::State;
using testing::Block;
using testing::block;
using testing::FactorScene;
using testing::FactorSubject;
using testing::SceneRequest;

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

// ---- subjects of the laws

template <class Plain, int kResiduals, int... kSizes>
std::unique_ptr<ceres::CostFunction> automatic(const Plain& plain) {
  return std::make_unique<ceres::AutoDiffCostFunction<Plain, kResiduals, kSizes...>>(new Plain(plain));
}

State moved_state(const core::Pose& T_new_W, State s) {
  s.T_W_B = T_new_W * s.T_W_B;
  s.v_W = T_new_W.q * s.v_W;
  return s;
}

FactorScene imu_scene(const std::vector<ImuSample>& samples, const ImuBias& bias, const State& from, const State& to) {
  const Preintegration z = preintegrate(samples, bias, kNoise);
  FactorScene s{std::make_unique<ImuFactor>(z, kGravity),
                automatic<testing::PlainImuResidual, core::kStateDof, kStateSize, kStateSize>({z, kGravity}),
                {}};
  s.blocks = {block(pack(from), &kStateManifold, 0.02), block(pack(to), &kStateManifold, 0.02)};
  return s;
}

// Samples that carry the state's own biases, white noise and a walk of the biases; the true end is where the samples
// without noise carry the state.
FactorScene imu_scene(const SceneRequest& request) {
  constexpr double kDt = 0.005;
  State from = random_state(2 * request.scene);
  std::vector<ImuSample> samples = random_samples(41, kDt, request.scene);
  for (ImuSample& s : samples) {
    s.gyro_rad_s += from.bias.gyro_rad_s;
    s.accel_m_s2 += from.bias.accel_m_s2;
  }
  State to = carry(from, samples, 0, samples.size() - 1, kGravity);
  const core::RandomStream noise({11, request.draw}, "noise");
  const double white = request.noise / std::sqrt(kDt);
  const double step = request.noise * std::sqrt(kDt);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const ImuBias walked{to.bias.gyro_rad_s - from.bias.gyro_rad_s, to.bias.accel_m_s2 - from.bias.accel_m_s2};
    samples[i].gyro_rad_s += walked.gyro_rad_s + kNoise.gyro_noise_density * white * noise.normal3(i, 0);
    samples[i].accel_m_s2 += walked.accel_m_s2 + kNoise.accel_noise_density * white * noise.normal3(i, 1);
    if (i + 1 == samples.size()) break;
    to.bias.gyro_rad_s += kNoise.gyro_bias_walk * step * noise.normal3(i, 2);
    to.bias.accel_m_s2 += kNoise.accel_bias_walk * step * noise.normal3(i, 3);
  }
  FactorScene s = imu_scene(samples, from.bias, from, to);
  for (std::uint64_t k : {0U, 1U}) {
    Block& b = s.blocks[k];
    if (request.off_truth) testing::displace(b, 0.1, kRandom, 300 + request.scene, k);
    b.values = block(pack(moved_state(request.T_new_W, unpack_state(b.values.data())))).values;
  }
  return s;
}

std::vector<FactorScene> imu_limits() {
  std::vector<ImuSample> rest;
  for (int i = 0; i <= 20; ++i) rest.push_back({core::to_ns(0.005 * i), {0, 0, 0}, {0, 0, kGravity}});
  State turned;
  turned.T_W_B.q = core::exp_quaternion(Eigen::Vector3d(1.8, -1.8, 1.5));  // 2.96 rad off what was integrated
  std::vector<FactorScene> limits;
  limits.push_back(imu_scene(rest, {}, State{}, State{}));
  limits.push_back(imu_scene(rest, {}, State{}, turned));
  return limits;
}

FactorScene state_prior_scene(const SceneRequest& request) {
  const State truth = moved_state(request.T_new_W, random_state(request.scene));
  const core::StateSigmas sigma{0.01, 0.02, 0.05, 0.005, 0.1};
  core::StateTangent n;
  for (std::uint64_t i = 0; i < 5; ++i) {
    n.segment<3>(3 * static_cast<int>(i)) = request.noise * kRandom.normal3(4000 + request.draw, i);
  }
  // The noise of a position is of the world's axes, so that it turns with them.
  n.head<3>() = request.T_new_W.q * n.head<3>();
  n.segment<3>(core::kVelocity) = request.T_new_W.q * n.segment<3>(core::kVelocity);
  const State mean = core::plus(truth, n.cwiseProduct(sigma.per_axis()));
  FactorScene s{std::make_unique<StatePriorFactor>(mean, sigma),
                automatic<testing::PlainStatePrior, core::kStateDof, kStateSize>({mean, sigma.per_axis()}),
                {}};
  s.blocks = {block(pack(truth), &kStateManifold, 0.01)};
  return s;
}

FactorScene extrinsics_prior_scene(const SceneRequest& request) {
  const core::Pose truth = random_state(request.scene).T_W_B;
  const core::Pose mean{truth.q * core::exp_quaternion(0.3 * request.noise * kRandom.normal3(5000 + request.draw, 0)),
                        truth.p + 0.02 * request.noise * kRandom.normal3(5000 + request.draw, 1)};
  FactorScene s{std::make_unique<ExtrinsicsPriorFactor>(mean, 0.02, 0.3),
                automatic<testing::PlainExtrinsicsPrior, 6, kPoseSize>({mean, 0.02, 0.3}),
                {}};
  s.blocks = {block(pack(truth), &kPoseManifold, 0.01)};
  return s;
}

FactorScene scalar_prior_scene(const SceneRequest& request) {
  const double truth = 0.01 * static_cast<double>(request.scene);
  const double mean = truth + 0.005 * request.noise * kRandom.normal(6000 + request.draw);
  FactorScene s{
      std::make_unique<ScalarPriorFactor>(mean, 0.005), automatic<testing::PlainScalarPrior, 1, 1>({mean, 0.005}), {}};
  s.blocks = {testing::scalar_block(truth, 0.01)};
  return s;
}

// A mean that is the state itself, and one a rotation of nearly pi away.
std::function<std::vector<FactorScene>()> prior_limits(FactorScene (*scene)(const SceneRequest&)) {
  return [scene] {
    std::vector<FactorScene> limits;
    limits.push_back(scene(SceneRequest{.scene = 1}));
    limits.push_back(scene(SceneRequest{.scene = 2, .noise = 1e-9, .draw = 2}));
    return limits;
  };
}

std::vector<FactorSubject> subjects() {
  return {
      // Rounding, whitened by 1e5. Both ends of a midpoint step share its noise, so that the sum holds N - 1/2 noises
      // of N: -1.25 %.
      {.name = "Imu",
       .scene = [](const SceneRequest& r) { return imu_scene(r); },
       .limits = imu_limits,
       .zero_tolerance = 1e-7,
       .whitening_slack = 0.0125},
      {.name = "StatePrior", .scene = state_prior_scene, .limits = prior_limits(state_prior_scene)},
      {.name = "ExtrinsicsPrior", .scene = extrinsics_prior_scene, .limits = prior_limits(extrinsics_prior_scene)},
      {.name = "ScalarPrior", .scene = scalar_prior_scene, .limits = prior_limits(scalar_prior_scene)},
  };
}

}  // namespace
}  // namespace plumbline::estimator

namespace plumbline::testing {
INSTANTIATE_TEST_SUITE_P(Factors, FactorLaws, ::testing::ValuesIn(estimator::subjects()), subject_name);
}  // namespace plumbline::testing

namespace plumbline::estimator {
namespace {

TEST(ImuFactor, SeesATilt) {
  const SceneRequest request{.scene = 3};
  FactorScene s = imu_scene(request);
  const core::Pose tilted{core::exp_quaternion(Eigen::Vector3d(0.01, 0.0, 0.0)), {}};
  for (Block& b : s.blocks) b.values = block(pack(moved_state(tilted, unpack_state(b.values.data())))).values;
  EXPECT_GT(testing::residual(*s.factor, s.blocks).norm(), 1.0);  // gravity has a direction
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

TEST(PriorFactors, WhitenExactly) {
  const State truth = random_state(1);
  const core::StateSigmas sigma{0.01, 0.02, 0.05, 0.005, 0.1};
  core::StateTangent n;
  for (int i = 0; i < 5; ++i) n.segment<3>(3 * i) = kRandom.normal3(400, static_cast<std::uint64_t>(i));
  const State mean = core::plus(truth, n.cwiseProduct(sigma.per_axis()));
  const StatePriorFactor state_prior(mean, sigma);
  const std::vector<Block> at_truth = {block(pack(truth), &kStateManifold)};
  EXPECT_LT((testing::residual(state_prior, at_truth) - n).norm(), 1e-10);
  const ScalarPriorFactor scalar(0.02, 0.005);
  EXPECT_NEAR(testing::residual(scalar, {{{0.01}, nullptr}})[0], 2.0, 1e-12);
}

}  // namespace
}  // namespace plumbline::estimator
