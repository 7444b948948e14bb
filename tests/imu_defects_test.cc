// Each defect of the inertial sensor does what sim/imu_sensor.h says, and nothing else.
#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

#include <gtest/gtest.h>

#include "sim/imu_sensor.h"

namespace plumbline::sim {
namespace {

constexpr core::TrialId kId{.seed = 1, .trial = 0};
constexpr double kGravity = 9.81;
constexpr double kDurationS = 20.0;

// Rate and specific force differ from axis to axis and in time.
class Tumbling final : public Trajectory {
 public:
  Kinematics at(double t_s) const override {
    const Eigen::Vector3d axis = Eigen::Vector3d(1.0, -2.0, 0.5).normalized();
    return {.T_W_B = {Eigen::Quaterniond(Eigen::AngleAxisd(1.3 * t_s, axis)), Eigen::Vector3d::Zero()},
            .v_W = Eigen::Vector3d::Zero(),
            .a_W = Eigen::Vector3d(2.0 * std::sin(t_s), std::cos(3.0 * t_s), 0.3),
            .omega_B = 1.3 * axis + Eigen::Vector3d(0.0, 0.0, std::sin(2.0 * t_s)),
            .alpha_B = Eigen::Vector3d::Zero()};
  }
};

ImuRecording record(const ImuConfig& config) { return simulate_imu(Tumbling(), config, kGravity, kDurationS, kId); }

// All of its noise, and no defect.
ImuConfig noisy() {
  ImuConfig config;
  config.noise = {
      .gyro_noise_density = 1.7e-3, .gyro_bias_walk = 2e-3, .accel_noise_density = 2e-2, .accel_bias_walk = 3e-2};
  config.gyro_bias_rad_s = {0.01, -0.02, 0.015};
  config.accel_bias_m_s2 = {0.05, -0.08, 0.03};
  return config;
}

struct Ideal {
  Eigen::Vector3d w;
  Eigen::Vector3d f;
};
Ideal ideal_at(double t_s) {
  const Kinematics k = Tumbling().at(t_s);
  return {k.omega_B, k.T_W_B.q.conjugate() * (k.a_W + Eigen::Vector3d(0.0, 0.0, kGravity))};
}

// What the defect adds to the noisy recording, sample by sample, as a function of the ideal input. The noise cancels to
// rounding.
void expect_added(const ImuConfig& config, const std::function<Ideal(const Ideal&)>& added) {
  const ImuRecording before = record(noisy());
  const ImuRecording after = record(config);
  ASSERT_EQ(after.samples.size(), before.samples.size());
  EXPECT_EQ(after.stamps_ns, before.stamps_ns);
  for (std::size_t i = 0; i < after.samples.size(); ++i) {
    const Ideal expected = added(ideal_at(static_cast<double>(i) / 200.0));
    ASSERT_EQ(after.samples[i].t_ns, before.samples[i].t_ns);
    ASSERT_LT((after.samples[i].gyro_rad_s - before.samples[i].gyro_rad_s - expected.w).norm(), 1e-13) << i;
    ASSERT_LT((after.samples[i].accel_m_s2 - before.samples[i].accel_m_s2 - expected.f).norm(), 1e-13) << i;
    ASSERT_EQ(after.biases[i].gyro_rad_s, before.biases[i].gyro_rad_s);
    ASSERT_EQ(after.biases[i].accel_m_s2, before.biases[i].accel_m_s2);
  }
}

TEST(ImuDefects, ScaleErrorIsOfTheOwnAxis) {
  const Eigen::Vector3d gyro(0.01, -0.02, 0.03);
  const Eigen::Vector3d accel(-0.005, 0.004, 0.02);
  ImuConfig config = noisy();
  config.gyro.scale_error = gyro;
  config.accel.scale_error = accel;
  expect_added(config, [&](const Ideal& x) -> Ideal { return {gyro.cwiseProduct(x.w), accel.cwiseProduct(x.f)}; });
}

TEST(ImuDefects, MisalignmentFeelsTheOtherAxes) {
  ImuConfig config = noisy();
  config.gyro.misalignment_rad << 0.01, 0.02, 0.03, 0.04, 0.05, 0.06;
  config.accel.misalignment_rad << -0.01, 0.0, 0.0, 0.0, 0.0, 0.002;
  expect_added(config, [](const Ideal& x) -> Ideal {
    return {{0.01 * x.w.y() + 0.02 * x.w.z(), 0.03 * x.w.x() + 0.04 * x.w.z(), 0.05 * x.w.x() + 0.06 * x.w.y()},
            {-0.01 * x.f.y(), 0.0, 0.002 * x.f.y()}};
  });
}

// The scale is that of the reading: it holds for what the axis feels of the others too.
TEST(ImuDefects, ScaleComesAfterMisalignment) {
  ImuConfig config = noisy();
  config.gyro.scale_error = {0.1, 0.0, 0.0};
  config.gyro.misalignment_rad << 0.2, 0.0, 0.0, 0.0, 0.0, 0.0;
  expect_added(config, [](const Ideal& x) -> Ideal {
    return {{0.1 * x.w.x() + 1.1 * 0.2 * x.w.y(), 0.0, 0.0}, Eigen::Vector3d::Zero()};
  });
}

TEST(ImuDefects, GyroFeelsTheSpecificForce) {
  ImuConfig config = noisy();
  config.g_sensitivity << 1e-3, 2e-3, 3e-3, 4e-3, 5e-3, 6e-3, 7e-3, 8e-3, 9e-3;
  expect_added(config, [](const Ideal& x) -> Ideal {
    return {{1e-3 * x.f.x() + 2e-3 * x.f.y() + 3e-3 * x.f.z(), 4e-3 * x.f.x() + 5e-3 * x.f.y() + 6e-3 * x.f.z(),
             7e-3 * x.f.x() + 8e-3 * x.f.y() + 9e-3 * x.f.z()},
            Eigen::Vector3d::Zero()};
  });
}

// The same draws, larger on the axis that is noisier than the data sheet says.
TEST(ImuDefects, NoiseFactorScalesTheWhiteNoiseOfItsAxis) {
  ImuConfig silent = noisy();
  silent.gyro.noise_factor.setZero();
  silent.accel.noise_factor.setZero();
  ImuConfig louder = noisy();
  louder.gyro.noise_factor = {1.0, 3.0, 0.5};
  louder.accel.noise_factor = {2.0, 1.0, 0.0};
  const ImuRecording none = record(silent);
  const ImuRecording stated = record(noisy());
  const ImuRecording changed = record(louder);
  for (std::size_t i = 0; i < none.samples.size(); ++i) {
    const Eigen::Vector3d gyro = stated.samples[i].gyro_rad_s - none.samples[i].gyro_rad_s;
    const Eigen::Vector3d accel = stated.samples[i].accel_m_s2 - none.samples[i].accel_m_s2;
    const Eigen::Vector3d gyro_changed = changed.samples[i].gyro_rad_s - none.samples[i].gyro_rad_s;
    const Eigen::Vector3d accel_changed = changed.samples[i].accel_m_s2 - none.samples[i].accel_m_s2;
    ASSERT_GT(gyro.cwiseAbs().minCoeff(), 0.0);
    ASSERT_LT((gyro_changed - louder.gyro.noise_factor.cwiseProduct(gyro)).norm(), 1e-13);
    ASSERT_LT((accel_changed - louder.accel.noise_factor.cwiseProduct(accel)).norm(), 1e-13);
    ASSERT_EQ(changed.biases[i].gyro_rad_s, stated.biases[i].gyro_rad_s);
  }
}

TEST(ImuDefects, SaturationClipsAtItsLimit) {
  ImuConfig config = noisy();
  config.gyro.saturation = 1.0;
  config.accel.saturation = 9.0;
  const ImuRecording before = record(noisy());
  const ImuRecording after = record(config);
  int clipped = 0;
  for (std::size_t i = 0; i < after.samples.size(); ++i) {
    ASSERT_EQ(after.samples[i].gyro_rad_s, before.samples[i].gyro_rad_s.cwiseMax(-1.0).cwiseMin(1.0));
    ASSERT_EQ(after.samples[i].accel_m_s2, before.samples[i].accel_m_s2.cwiseMax(-9.0).cwiseMin(9.0));
    clipped += after.samples[i].gyro_rad_s != before.samples[i].gyro_rad_s ? 1 : 0;
  }
  EXPECT_GT(clipped, 100);
}

TEST(ImuDefects, QuantisationRoundsToTheNearestStep) {
  ImuConfig config = noisy();
  config.gyro.quantisation = 0.0625;  // powers of two, so that multiples are exact
  config.accel.quantisation = 0.25;
  const ImuRecording before = record(noisy());
  const ImuRecording after = record(config);
  for (std::size_t i = 0; i < after.samples.size(); ++i) {
    const Eigen::Vector3d steps = after.samples[i].gyro_rad_s / 0.0625;
    ASSERT_EQ(steps, steps.array().round().matrix());
    ASSERT_LE((after.samples[i].gyro_rad_s - before.samples[i].gyro_rad_s).cwiseAbs().maxCoeff(), 0.03125);
    ASSERT_LE((after.samples[i].accel_m_s2 - before.samples[i].accel_m_s2).cwiseAbs().maxCoeff(), 0.125);
  }
}

// Clipped last: the limit holds although it is no multiple of the step.
TEST(ImuDefects, SaturationComesAfterQuantisation) {
  ImuConfig config = noisy();
  config.gyro.quantisation = 0.25;
  config.gyro.saturation = 0.9;
  double largest = 0.0;
  for (const core::ImuSample& sample : record(config).samples) {
    largest = std::max(largest, sample.gyro_rad_s.cwiseAbs().maxCoeff());
  }
  EXPECT_EQ(largest, 0.9);
}

TEST(ImuDefects, StampJitterMovesOnlyTheStamps) {
  ImuConfig config = noisy();
  config.stamp_jitter_s = 5e-4;
  const ImuRecording before = record(noisy());
  const ImuRecording after = record(config);
  ASSERT_EQ(after.samples.size(), before.samples.size());
  EXPECT_EQ(after.samples.front().t_ns, before.samples.front().t_ns);
  EXPECT_EQ(after.samples.back().t_ns, before.samples.back().t_ns);
  double sum = 0.0;
  double sum2 = 0.0;
  for (std::size_t i = 0; i < after.samples.size(); ++i) {
    ASSERT_EQ(after.samples[i].gyro_rad_s, before.samples[i].gyro_rad_s);
    ASSERT_EQ(after.samples[i].accel_m_s2, before.samples[i].accel_m_s2);
    ASSERT_EQ(after.samples[i].t_ns, after.stamps_ns[i]);
    if (i > 0) {
      ASSERT_GT(after.samples[i].t_ns, after.samples[i - 1].t_ns);
    }
    const double jitter = core::to_seconds(after.samples[i].t_ns - before.samples[i].t_ns) / 5e-4;
    ASSERT_LE(std::abs(jitter), 4.0 + 1e-5);  // of rounding to nanoseconds
    sum += jitter;
    sum2 += jitter * jitter;
  }
  const auto n = static_cast<double>(after.samples.size() - 2);
  EXPECT_LT(std::abs(sum) / std::sqrt(n), 4.5);
  EXPECT_LT(std::abs(sum2 - n) / std::sqrt(2.0 * n), 4.5);  // the cut takes less than 1e-4 of the variance
}

TEST(ImuDefects, LargeJitterKeepsTheOrder) {
  ImuConfig config = noisy();
  config.stamp_jitter_s = 0.1 / config.rate_hz;  // the largest that is allowed
  ASSERT_FALSE(validate(config).has_value());
  const ImuRecording recording = simulate_imu(Tumbling(), config, kGravity, 300.0, kId);
  for (std::size_t i = 1; i < recording.samples.size(); ++i) {
    ASSERT_GT(recording.samples[i].t_ns, recording.samples[i - 1].t_ns);
  }
  config.stamp_jitter_s *= 1.001;
  EXPECT_EQ(validate(config).value().key, "stamp_jitter_s");
}

TEST(ImuDefects, DropoutsTakeSamplesAwayAndChangeNone) {
  ImuConfig config = noisy();
  config.dropout_probability = 0.05;
  config.dropout_samples = 3;
  const ImuRecording before = record(noisy());
  const ImuRecording after = record(config);
  EXPECT_EQ(after.stamps_ns, before.stamps_ns);  // the truth speaks of all samples
  EXPECT_EQ(after.samples.front().t_ns, before.samples.front().t_ns);
  EXPECT_EQ(after.samples.back().t_ns, before.samples.back().t_ns);
  auto kept = after.samples.begin();
  for (const core::ImuSample& sample : before.samples) {
    if (kept->t_ns != sample.t_ns) continue;
    ASSERT_EQ(kept->gyro_rad_s, sample.gyro_rad_s);
    ASSERT_EQ(kept->accel_m_s2, sample.accel_m_s2);
    ++kept;
  }
  EXPECT_EQ(kept, after.samples.end());
  // A sample is there unless a gap began at it or at one of the two before it.
  const auto n = static_cast<double>(before.samples.size());
  const double p = std::pow(0.95, 3);
  const double deviation = static_cast<double>(after.samples.size()) - p * n;
  // Neighbours share gaps: the variance is below 2 * 3 - 1 times that of independent samples.
  EXPECT_LT(std::abs(deviation) / std::sqrt(5.0 * n * p * (1.0 - p)), 4.5);
  EXPECT_LT(after.samples.size(), before.samples.size());
}

TEST(ImuDefects, EndsSurviveWhateverDropsOut) {
  ImuConfig config;
  config.dropout_probability = 1.0;
  const ImuRecording recording = record(config);
  ASSERT_EQ(recording.samples.size(), 2U);
  EXPECT_EQ(recording.samples.front().t_ns, 0);
  EXPECT_EQ(recording.samples.back().t_ns, 20'000'000'000);
}

}  // namespace
}  // namespace plumbline::sim
