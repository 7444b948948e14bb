#include "sim/trajectory.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <Eigen/Eigenvalues>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "recorded_motion.h"
#include "sim/handheld_motion.h"
#include "sim/harmonic_trajectory.h"
#include "sim/loop_motion.h"

namespace plumbline::sim {
namespace {

// Derivative of f at 0, of fourth order. Motion slower than 2 Hz has f^(5) < 13^4 of the derivative itself, or 10 times
// that within a spline that follows noise: with h = 1e-3 the truncation h^4 f^(5)/30 is below 1e-8, the rounding of
// positions of some metres 1e-15/h.
constexpr double kRelative = 1e-7;
constexpr double kRounding = 1e-11;
template <class F>
Eigen::Vector3d derivative(const F& f) {
  constexpr double kStepS = 1e-3;
  return (8.0 * (f(kStepS) - f(-kStepS)) - (f(2.0 * kStepS) - f(-2.0 * kStepS))) / (12.0 * kStepS);
}

class EveryTrajectory : public testing::TestWithParam<TrajectoryType> {};

TEST_P(EveryTrajectory, DerivativesMatchDifferences) {
  const auto trajectory = make_trajectory(config_of(GetParam()), kDurationS, kId);
  const MotionStrength strength = motion_strength(*trajectory, kDurationS);
  for (int i = 0; i < 60; ++i) {
    // Clear of the knots of the spline, where f^(5) jumps.
    const double t = 0.1 * (i + 1) + 0.005 + 0.09 * std::fmod(0.618 * i, 1.0);
    const Kinematics k = trajectory->at(t);
    const auto position = [&](double s) -> Eigen::Vector3d { return trajectory->pose_at(t + s).p; };
    const auto rotation = [&](double s) {
      return core::log_so3(Eigen::Quaterniond(k.T_W_B.q.conjugate() * trajectory->pose_at(t + s).q));
    };
    const auto velocity = [&](double s) -> Eigen::Vector3d { return trajectory->at(t + s).v_W; };
    const auto rate = [&](double s) -> Eigen::Vector3d { return trajectory->at(t + s).omega_B; };
    EXPECT_LT((k.v_W - derivative(position)).norm(), kRelative * strength.speed_rms_m_s + kRounding) << t;
    EXPECT_LT((k.a_W - derivative(velocity)).norm(), kRelative * strength.acceleration_rms_m_s2 + kRounding) << t;
    EXPECT_LT((k.omega_B - derivative(rotation)).norm(), kRelative * strength.rate_rms_rad_s + kRounding) << t;
    EXPECT_LT((k.alpha_B - derivative(rate)).norm(), kRelative * strength.angular_acceleration_rms_rad_s2 + kRounding)
        << t;
  }
}

TEST_P(EveryTrajectory, PoseIsThatOfTheKinematics) {
  const auto trajectory = make_trajectory(config_of(GetParam()), kDurationS, kId);
  for (int i = 0; i <= 200; ++i) {
    const double t = kDurationS * i / 200.0;
    const core::Pose pose = trajectory->pose_at(t);
    const core::Pose other = trajectory->at(t).T_W_B;
    // The same sums, perhaps in another order.
    EXPECT_LT((pose.p - other.p).norm(), 1e-14);
    EXPECT_LT(rotation_distance(pose, other), 1e-14);
    EXPECT_NEAR(pose.q.norm(), 1.0, 1e-15);
  }
}

TEST_P(EveryTrajectory, TrialsShareTheMotion) {
  const TrajectoryConfig config = config_of(GetParam());
  const auto a = make_trajectory(config, kDurationS, {.seed = 1, .trial = 0});
  const auto b = make_trajectory(config, kDurationS, {.seed = 1, .trial = 5});
  const auto other = make_trajectory(config, kDurationS, {.seed = 2, .trial = 0});
  EXPECT_EQ(a->pose_at(3.3).p, b->pose_at(3.3).p);
  EXPECT_EQ(a->pose_at(3.3).q.coeffs(), b->pose_at(3.3).q.coeffs());
  const bool differs = (a->pose_at(3.3).p - other->pose_at(3.3).p).norm() > 0.01 ||
                       rotation_distance(a->pose_at(3.3), other->pose_at(3.3)) > 0.01;
  EXPECT_EQ(differs, GetParam() <= TrajectoryType::kPureRotation);  // those that are drawn come first
}

// Ten minutes, or the recording: finite, and no jump between neighbouring milliseconds beyond what a millisecond of
// 100 m/s^2 adds to the speed.
TEST_P(EveryTrajectory, IsFiniteAndContinuous) {
  const auto trajectory = make_trajectory(config_of(GetParam()), kDurationS, kId);
  const double length_s = GetParam() == TrajectoryType::kSpline ? kDurationS : 600.0;
  constexpr double kStepS = 1e-3;
  for (int i = 0; i < 1000; ++i) {
    const double t = (length_s - kStepS) * i / 999.0;
    const Kinematics k = trajectory->at(t);
    const Kinematics next = trajectory->at(t + kStepS);
    ASSERT_TRUE(k.T_W_B.p.allFinite() && k.T_W_B.q.coeffs().allFinite() && k.v_W.allFinite() && k.a_W.allFinite() &&
                k.omega_B.allFinite() && k.alpha_B.allFinite())
        << t;
    EXPECT_LT((next.T_W_B.p - k.T_W_B.p - kStepS * k.v_W).norm(), 100.0 * kStepS * kStepS) << t;
    EXPECT_LT(rotation_distance(next.T_W_B, {k.T_W_B.q * core::exp_quaternion(kStepS * k.omega_B), k.T_W_B.p}),
              100.0 * kStepS * kStepS)
        << t;
  }
}

std::vector<TrajectoryType> all_types() {
  std::vector<TrajectoryType> types;
  for (std::size_t i = 0; i < kTrajectoryTypeNames.size(); ++i) types.push_back(static_cast<TrajectoryType>(i));
  return types;
}

INSTANTIATE_TEST_SUITE_P(Types, EveryTrajectory, testing::ValuesIn(all_types()), [](const auto& type) {
  std::string name(kTrajectoryTypeNames[static_cast<std::size_t>(type.param)]);
  std::erase(name, '_');
  return name;
});

// Over 30 periods of the slowest sinusoid each mean square is within 1/(4 pi 30) = 0.3 % of its own; sums of sinusoids
// of neighbouring bands and the coupling of the Euler angles add a few per cent.
TEST(Handheld, MovesAsStronglyAsConfigured) {
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    const HarmonicTrajectory trajectory(handheld_shape(handheld_rs(), {.seed = seed, .trial = 0}));
    const MotionStrength strength = motion_strength(trajectory, 300.0);
    EXPECT_NEAR(strength.speed_rms_m_s, 0.7, 0.05 * 0.7) << seed;
    EXPECT_NEAR(strength.rate_rms_rad_s, 0.75, 0.05 * 0.75) << seed;
  }
}

// The published setting of td estimation speaks of turns of 1 to 1.5 rad/s.
TEST(Handheld, PeakRateOfTheReferenceSetting) {
  const MotionStrength strength = motion_strength(recorded(), 15.0);
  EXPECT_GT(strength.rate_peak_rad_s, 1.0);
  EXPECT_LT(strength.rate_peak_rad_s, 1.5);
}

TEST(Loops, ComeRoundWithTheBodyAhead) {
  const LoopConfig config{.radius_m = 2.0, .height_amplitude_m = 0.3, .period_s = 10.0};
  for (const auto& shape : {circle_shape(config), wavy_circle_shape(config), figure_eight_shape(config),
                            ball_shape(config), torus_shape(config)}) {
    const HarmonicTrajectory trajectory(shape);
    for (const double t : {0.0, 1.0, 4.2, 7.7, 31.0}) {
      const Kinematics k = trajectory.at(t);
      const Eigen::Vector3d x = k.T_W_B.q * Eigen::Vector3d::UnitX();
      EXPECT_NEAR(std::remainder(std::atan2(x.y(), x.x()) - std::atan2(k.v_W.y(), k.v_W.x()), 6.283185307179586), 0.0,
                  1e-13);
      EXPECT_GT(k.v_W.head<2>().norm(), 0.3);
    }
  }
  for (const auto& shape :
       {circle_shape(config), wavy_circle_shape(config), figure_eight_shape(config), torus_shape(config)}) {
    const HarmonicTrajectory trajectory(shape);
    EXPECT_LT((trajectory.pose_at(12.5).p - trajectory.pose_at(2.5).p).norm(), 1e-13);
  }
}

TEST(Loops, LieOnTheirSurfaces) {
  const LoopConfig config{
      .radius_m = 2.0, .height_amplitude_m = 0.3, .period_s = 10.0, .waves = 7, .tube_radius_m = 0.5};
  double farthest_m = 0.0;
  int crossings = 0;
  for (int i = 0; i <= 1000; ++i) {
    const double t = 10.0 * (i + 0.5) / 1000.0;
    const auto at = [&](const HarmonicTrajectory::Shape& shape, double s) {
      return HarmonicTrajectory(shape).pose_at(s).p;
    };
    EXPECT_NEAR(at(circle_shape(config), t).head<2>().norm(), 2.0, 1e-14);
    EXPECT_NEAR(at(ball_shape(config), t).norm(), 2.0, 1e-14);
    const Eigen::Vector3d p = at(torus_shape(config), t);
    EXPECT_NEAR(std::hypot(p.head<2>().norm() - 2.0, p.z()), 0.5, 1e-14);
    farthest_m = std::max(farthest_m, p.head<2>().norm());
    if (i < 1000) {
      crossings += at(wavy_circle_shape(config), t).z() * at(wavy_circle_shape(config), t + 0.01).z() < 0.0 ? 1 : 0;
    }
  }
  EXPECT_NEAR(farthest_m, 2.5, 1e-3);
  EXPECT_EQ(crossings, 2 * 7);
}

Eigen::Vector3d body_acceleration(const Kinematics& k) { return k.T_W_B.q.conjugate() * k.a_W; }

TEST(DegenerateMotions, HaveTheirDefiningProperty) {
  const auto made = [](TrajectoryType type) { return make_trajectory(config_of(type), kDurationS, kId); };
  const auto resting = made(TrajectoryType::kStatic);
  const auto twist = made(TrajectoryType::kConstantTwist);
  const auto accelerated = made(TrajectoryType::kConstantAcceleration);
  const auto translation = made(TrajectoryType::kPureTranslation);
  const auto rotation = made(TrajectoryType::kPureRotation);
  const auto planar = made(TrajectoryType::kPlanar);
  const ConstantMotionConfig constant;
  for (int i = 0; i <= 40; ++i) {
    const double t = 0.2 * i;
    Kinematics k = resting->at(t);
    EXPECT_EQ(k.T_W_B.p, Eigen::Vector3d::Zero());
    EXPECT_EQ(k.omega_B, Eigen::Vector3d::Zero());
    EXPECT_EQ(k.a_W, Eigen::Vector3d::Zero());
    k = twist->at(t);
    EXPECT_LT((k.T_W_B.q.conjugate() * k.v_W - constant.velocity_body_m_s).norm(), 1e-14);
    EXPECT_EQ(k.omega_B, constant.rate_rad_s);
    k = accelerated->at(t);
    EXPECT_EQ(k.a_W, constant.acceleration_m_s2);
    EXPECT_EQ(k.omega_B, constant.rate_rad_s);
    k = translation->at(t);
    EXPECT_EQ(k.omega_B, Eigen::Vector3d::Zero());
    EXPECT_EQ(k.T_W_B.q.coeffs(), Eigen::Quaterniond::Identity().coeffs());
    k = rotation->at(t);
    EXPECT_EQ(k.T_W_B.p, Eigen::Vector3d::Zero());
    k = planar->at(t);
    EXPECT_EQ(k.T_W_B.p.z(), 0.0);
    EXPECT_EQ(k.omega_B.head<2>(), Eigen::Vector2d::Zero());
  }
}

// Without rotation a constant acceleration is constant in the body too.
TEST(DegenerateMotions, ConstantBodyAccelerationWithoutRotation) {
  TrajectoryConfig config = config_of(TrajectoryType::kConstantAcceleration);
  config.constant.rate_rad_s.setZero();
  const auto trajectory = make_trajectory(config, kDurationS, kId);
  for (const double t : {0.0, 3.0, 8.0}) {
    EXPECT_EQ(body_acceleration(trajectory->at(t)), config.constant.acceleration_m_s2);
  }
}

TEST(DegenerateMotions, Sine3dKeepsTheBodyAccelerationWhileItTurnsAboutAllAxes) {
  const TrajectoryConfig config = config_of(TrajectoryType::kSine3d);
  const auto trajectory = make_trajectory(config, kDurationS, kId);
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  Eigen::AlignedBox3d box;
  for (int i = 0; i < 1000; ++i) {
    const Kinematics k = trajectory->at(0.08 * i);
    EXPECT_LT((body_acceleration(k) - Eigen::Vector3d(config.sine3d.acceleration_m_s2, 0.0, 0.0)).norm(), 1e-13);
    spread += k.omega_B * k.omega_B.transpose() / 1000.0;
    box.extend(k.T_W_B.p);
  }
  EXPECT_GT(spread.eigenvalues().real().minCoeff(), 0.01);  // (rad/s)^2
  EXPECT_LT(box.sizes().maxCoeff(), 20.0);                  // no drift: its slowest sinusoid has 0.5 (2/0.33)^2 / 2 m
  EXPECT_GT(box.sizes().minCoeff(), 1.0);
}

TEST(DegenerateMotions, OneAxisTurnsAboutThatAxisOnlyAndMovesInAllThree) {
  for (const BodyAxis axis : {BodyAxis::kX, BodyAxis::kY, BodyAxis::kZ}) {
    TrajectoryConfig config = config_of(TrajectoryType::kOneAxis);
    config.rotation_axis = axis;
    const auto trajectory = make_trajectory(config, 300.0, kId);
    Eigen::Vector3d rate2 = Eigen::Vector3d::Zero();
    Eigen::Vector3d speed2 = Eigen::Vector3d::Zero();
    for (int i = 0; i < 3000; ++i) {
      const Kinematics k = trajectory->at(0.1 * i);
      rate2 += k.omega_B.cwiseAbs2() / 3000.0;
      speed2 += k.v_W.cwiseAbs2() / 3000.0;
    }
    for (int i = 0; i < 3; ++i) {
      EXPECT_NEAR(std::sqrt(rate2[i]), i == static_cast<int>(axis) ? 0.75 : 0.0, 0.05 * 0.75);
      EXPECT_GT(speed2[i], 0.1);
    }
    EXPECT_EQ((rate2.array() == 0.0).count(), 2);
  }
}

TEST(Sinusoids, AreThoseOfTheKeys) {
  const auto trajectory = make_trajectory(config_of(TrajectoryType::kSinusoids), kDurationS, kId);
  constexpr double kTwoPi = 6.283185307179586;
  for (const double t : {0.0, 0.7, 5.3}) {
    const core::Pose pose = trajectory->pose_at(t);
    EXPECT_NEAR(pose.p.x(), 0.8 * std::sin(kTwoPi * 0.2 * t) + 0.1 * std::sin(kTwoPi * 1.1 * t), 1e-14);
    EXPECT_EQ(pose.p.y(), 0.0);
    EXPECT_EQ(pose.p.z(), 1.5);
    const Eigen::Quaterniond expected(
        Eigen::AngleAxisd(0.3 * std::sin(kTwoPi * 0.5 * t + 1.0), Eigen::Vector3d::UnitY()));
    EXPECT_LT(rotation_distance(pose, {expected, pose.p}), 1e-14);
  }
}

TEST(TrajectoryConfigRules, NameTheirKey) {
  const auto key = [](const TrajectoryConfig& c) { return validate(c).value_or(core::RuleViolation{}).key; };
  EXPECT_EQ(key({}), "");
  TrajectoryConfig waves;
  waves.sinusoids.yaw.amplitude = {0.1};
  EXPECT_EQ(key(waves), "sinusoids.yaw.frequency_hz");
  waves.sinusoids.yaw.frequency_hz = {0.1};
  EXPECT_EQ(key(waves), "");
  waves.sinusoids.yaw.phase_rad = {0.1, 0.2};
  EXPECT_EQ(key(waves), "sinusoids.yaw.phase_rad");
  TrajectoryConfig kitti;
  kitti.type = TrajectoryType::kSpline;
  EXPECT_EQ(key(kitti), "file");
  kitti.file = PLUMBLINE_SOURCE_DIR "/README.md";  // which is there
  EXPECT_EQ(key(kitti), "");
  kitti.format = core::PoseFormat::kKitti;
  EXPECT_EQ(key(kitti), "pose_rate_hz");
  TrajectoryConfig torus;
  torus.type = TrajectoryType::kTorus;
  torus.loop.tube_radius_m = torus.loop.radius_m;
  EXPECT_EQ(key(torus), "loop.tube_radius_m");
  TrajectoryConfig sine;
  sine.sine3d.pitch_period_s = sine.sine3d.yaw_period_s;
  EXPECT_EQ(key(sine), "sine3d.pitch_period_s");
}

}  // namespace
}  // namespace plumbline::sim
