#include "sim/imu_sensor.h"

#include <cmath>
#include <cstddef>
#include <numbers>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace plumbline::sim {
namespace {

constexpr core::TrialId kId{.seed = 1, .trial = 0};

class AtRest final : public Trajectory {
 public:
  explicit AtRest(const Eigen::Quaterniond& q = Eigen::Quaterniond::Identity()) : q_(q) {}
  Kinematics at(double /*t_s*/) const override {
    const Eigen::Vector3d zero = Eigen::Vector3d::Zero();
    return {.T_W_B = {q_, Eigen::Vector3d(1.0, 2.0, 3.0)}, .v_W = zero, .a_W = zero, .omega_B = zero, .alpha_B = zero};
  }

 private:
  Eigen::Quaterniond q_;
};

// A level left turn at 2 rad/s and 3 m/s, x ahead.
class LeftTurn final : public Trajectory {
 public:
  Kinematics at(double t_s) const override {
    const double angle = 2.0 * t_s;
    const Eigen::Vector3d ahead(std::cos(angle), std::sin(angle), 0.0);
    const Eigen::Vector3d left(-ahead.y(), ahead.x(), 0.0);
    return {.T_W_B = {Eigen::Quaterniond(Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ())), -1.5 * left},
            .v_W = 3.0 * ahead,
            .a_W = 6.0 * left,
            .omega_B = 2.0 * Eigen::Vector3d::UnitZ(),
            .alpha_B = Eigen::Vector3d::Zero()};
  }
};

// The standard score of a chi-square variable, by Wilson and Hilferty. |score| < 4.5 fails by chance in 7e-6 of cases.
constexpr double kLargestScore = 4.5;
double chi_square_score(double x, double dof) {
  return (std::cbrt(x / dof) - 1.0 + 2.0 / (9.0 * dof)) / std::sqrt(2.0 / (9.0 * dof));
}

// Draws of N(0, sigma^2 I), independent of one another, of their neighbours in time and of the other axes.
void expect_white(const std::vector<Eigen::Vector3d>& draws, double sigma) {
  const auto n = static_cast<double>(draws.size());
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  Eigen::Matrix3d product = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d lagged = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < draws.size(); ++i) {
    const Eigen::Vector3d x = draws[i] / sigma;
    sum += x;
    product += x * x.transpose();
    if (i > 0) lagged += x * draws[i - 1].transpose() / sigma;
  }
  for (int i = 0; i < 3; ++i) {
    EXPECT_LT(std::abs(sum[i]) / std::sqrt(n), kLargestScore) << i;
    EXPECT_LT(std::abs(chi_square_score(product(i, i), n)), kLargestScore) << i;
    for (int j = 0; j < 3; ++j) {
      if (j < i) {
        EXPECT_LT(std::abs(product(i, j)) / std::sqrt(n), kLargestScore) << i << j;
      }
      EXPECT_LT(std::abs(lagged(i, j)) / std::sqrt(n), kLargestScore) << i << j;
    }
  }
}

TEST(ImuSensor, AtRestFeelsTheSupport) {
  const ImuRecording level = simulate_imu(AtRest(), {}, 9.81, 1.0, kId);
  EXPECT_EQ(level.samples.front().accel_m_s2, Eigen::Vector3d(0.0, 0.0, 9.81));
  EXPECT_EQ(level.samples.front().gyro_rad_s, Eigen::Vector3d::Zero());

  // Rolled to the right by -90 degrees about x, the body's y axis points up: +g on y, not on -y.
  const Eigen::Quaterniond rolled(Eigen::AngleAxisd(0.5 * std::numbers::pi, Eigen::Vector3d::UnitX()));
  const ImuRecording side = simulate_imu(AtRest(rolled), {}, 9.81, 1.0, kId);
  EXPECT_LT((side.samples.front().accel_m_s2 - Eigen::Vector3d(0.0, 9.81, 0.0)).norm(), 1e-14);
}

TEST(ImuSensor, LeftTurnPushesLeft) {
  const ImuRecording turn = simulate_imu(LeftTurn(), {}, 9.81, 5.0, kId);
  for (const core::ImuSample& sample : turn.samples) {
    EXPECT_EQ(sample.gyro_rad_s, Eigen::Vector3d(0.0, 0.0, 2.0));
    EXPECT_LT((sample.accel_m_s2 - Eigen::Vector3d(0.0, 6.0, 9.81)).norm(), 1e-13);
  }
}

TEST(ImuSensor, StampsAreMultiplesOfTheInterval) {
  for (const auto& [rate_hz, dt_ns] : {std::pair{200.0, 5'000'000}, std::pair{100.0, 10'000'000}}) {
    ImuConfig config;
    config.rate_hz = rate_hz;
    const ImuRecording recording = simulate_imu(AtRest(), config, 9.81, 15.0, kId);
    ASSERT_EQ(recording.samples.size(), static_cast<std::size_t>(15.0 * rate_hz) + 1);
    ASSERT_EQ(recording.biases.size(), recording.samples.size());
    for (std::size_t i = 0; i < recording.samples.size(); ++i) {
      ASSERT_EQ(recording.samples[i].t_ns, static_cast<core::TimeNs>(i) * dt_ns);
    }
  }
  // 14.995 is the last multiple of 5 ms before the end, and 14.9999 is not reached.
  EXPECT_EQ(simulate_imu(AtRest(), {}, 9.81, 14.9999, kId).samples.back().t_ns, 14'995'000'000);
}

// sigma/sqrt(dt) = sigma sqrt(rate).
TEST(ImuSensor, WhiteNoiseFollowsTheDensity) {
  for (const double rate_hz : {100.0, 400.0}) {
    ImuConfig config;
    config.rate_hz = rate_hz;
    config.noise = {.gyro_noise_density = 1.7e-4, .accel_noise_density = 2e-3};
    const ImuRecording recording = simulate_imu(AtRest(), config, 9.81, 20.0, kId);
    std::vector<Eigen::Vector3d> gyro;
    std::vector<Eigen::Vector3d> accel;
    std::vector<Eigen::Vector3d> sum;  // white only if the two are independent
    for (const core::ImuSample& sample : recording.samples) {
      gyro.push_back(sample.gyro_rad_s);
      accel.emplace_back(sample.accel_m_s2 - Eigen::Vector3d(0.0, 0.0, 9.81));
      sum.emplace_back(gyro.back() / 1.7e-4 + accel.back() / 2e-3);
    }
    expect_white(gyro, 1.7e-4 * std::sqrt(rate_hz));
    expect_white(accel, 2e-3 * std::sqrt(rate_hz));
    expect_white(sum, std::sqrt(2.0 * rate_hz));
    for (const core::ImuBias& bias : recording.biases) {
      EXPECT_EQ(bias.gyro_rad_s, Eigen::Vector3d::Zero());
      EXPECT_EQ(bias.accel_m_s2, Eigen::Vector3d::Zero());
    }
  }
}

// sigma_b sqrt(dt) a step, from the configured start.
TEST(ImuSensor, BiasWalksByTheDensity) {
  for (const double rate_hz : {100.0, 400.0}) {
    ImuConfig config;
    config.rate_hz = rate_hz;
    config.noise = {.gyro_bias_walk = 2e-5, .accel_bias_walk = 3e-3};
    config.gyro_bias_rad_s = {0.01, -0.02, 0.015};
    config.accel_bias_m_s2 = {0.05, -0.08, 0.03};
    const ImuRecording recording = simulate_imu(AtRest(), config, 0.0, 20.0, kId);
    EXPECT_EQ(recording.biases.front().gyro_rad_s, config.gyro_bias_rad_s);
    EXPECT_EQ(recording.biases.front().accel_m_s2, config.accel_bias_m_s2);
    std::vector<Eigen::Vector3d> gyro;
    std::vector<Eigen::Vector3d> accel;
    std::vector<Eigen::Vector3d> sum;
    for (std::size_t i = 1; i < recording.biases.size(); ++i) {
      gyro.emplace_back(recording.biases[i].gyro_rad_s - recording.biases[i - 1].gyro_rad_s);
      accel.emplace_back(recording.biases[i].accel_m_s2 - recording.biases[i - 1].accel_m_s2);
      sum.emplace_back(gyro.back() / 2e-5 + accel.back() / 3e-3);
    }
    expect_white(gyro, 2e-5 / std::sqrt(rate_hz));
    expect_white(accel, 3e-3 / std::sqrt(rate_hz));
    expect_white(sum, std::sqrt(2.0 / rate_hz));
  }
}

// Without white noise, what is measured beyond the ideal is the bias that the truth states, at that very sample: at
// rest and without gravity to the bit.
TEST(ImuSensor, TrueBiasIsWhatWasAdded) {
  ImuConfig config;
  config.noise = {.gyro_bias_walk = 0.01, .accel_bias_walk = 0.1};
  config.gyro_bias_rad_s = {0.01, -0.02, 0.015};
  config.accel_bias_m_s2 = {0.05, -0.08, 0.03};
  const ImuRecording recording = simulate_imu(AtRest(), config, 0.0, 5.0, kId);
  for (std::size_t i = 0; i < recording.samples.size(); ++i) {
    ASSERT_EQ(recording.samples[i].gyro_rad_s, recording.biases[i].gyro_rad_s) << i;
    ASSERT_EQ(recording.samples[i].accel_m_s2, recording.biases[i].accel_m_s2) << i;
  }
}

TEST(ImuSensor, WhiteNoiseAndWalkHaveStreamsOfTheirOwn) {
  ImuConfig white;
  white.noise = {.gyro_noise_density = 1e-3, .accel_noise_density = 1e-2};
  ImuConfig both = white;
  both.noise.gyro_bias_walk = 1e-3;
  both.noise.accel_bias_walk = 1e-2;
  const ImuRecording a = simulate_imu(AtRest(), white, 0.0, 2.0, kId);
  const ImuRecording b = simulate_imu(AtRest(), both, 0.0, 2.0, kId);
  for (std::size_t i = 0; i < a.samples.size(); ++i) {
    // Rounding of a sum of numbers below 1.
    EXPECT_LT((b.samples[i].gyro_rad_s - b.biases[i].gyro_rad_s - a.samples[i].gyro_rad_s).norm(), 1e-15);
    EXPECT_LT((b.samples[i].accel_m_s2 - b.biases[i].accel_m_s2 - a.samples[i].accel_m_s2).norm(), 1e-15);
  }
}

}  // namespace
}  // namespace plumbline::sim
