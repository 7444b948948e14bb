#include "sim/imu_sensor.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "core/error.h"
#include "core/physical_ranges.h"

namespace plumbline::sim {
namespace {

Eigen::Matrix3d response(const TriadDefects& defects) {
  const auto& m = defects.misalignment_rad;
  Eigen::Matrix3d axes;
  axes << 1.0, m[0], m[1], m[2], 1.0, m[3], m[4], m[5], 1.0;
  return (Eigen::Vector3d::Ones() + defects.scale_error).asDiagonal() * axes;
}

Eigen::Vector3d read_out(const TriadDefects& defects, const Eigen::Vector3d& x) {
  return x.unaryExpr([&](double value) {
    if (defects.quantisation > 0.0) value = defects.quantisation * std::round(value / defects.quantisation);
    if (defects.saturation > 0.0) value = std::clamp(value, -defects.saturation, defects.saturation);
    return value;
  });
}

// Whether the samples are missing. A gap begins at a sample by chance and lasts as many as it does.
std::vector<bool> dropouts(const ImuConfig& config, std::size_t count, core::TrialId id) {
  const core::RandomStream stream(id, "imu0/dropout");
  std::vector<bool> missing(count, false);
  for (std::size_t i = 1; i + 1 < count; ++i) {
    if (stream.uniform(i) >= config.dropout_probability) continue;
    const std::size_t end = std::min(count - 1, i + static_cast<std::size_t>(config.dropout_samples));
    std::fill(missing.begin() + static_cast<std::ptrdiff_t>(i), missing.begin() + static_cast<std::ptrdiff_t>(end),
              true);
  }
  return missing;
}

}  // namespace

ImuRecording simulate_imu(const Trajectory& trajectory, const ImuConfig& config, double gravity_m_s2, double duration_s,
                          core::TrialId id) {
  const core::RandomStream gyro_white(id, "imu0/gyro_white");
  const core::RandomStream accel_white(id, "imu0/accel_white");
  const core::RandomStream gyro_walk(id, "imu0/gyro_walk");
  const core::RandomStream accel_walk(id, "imu0/accel_walk");
  const core::RandomStream stamp_jitter(id, "imu0/stamp_jitter");
  const double dt = 1.0 / config.rate_hz;
  const double white = 1.0 / std::sqrt(dt);
  const double walk = std::sqrt(dt);
  const core::ImuNoise& noise = config.noise;
  const Eigen::Vector3d gyro_sigma = noise.gyro_noise_density * white * config.gyro.noise_factor;
  const Eigen::Vector3d accel_sigma = noise.accel_noise_density * white * config.accel.noise_factor;
  const Eigen::Vector3d gravity_W(0.0, 0.0, -gravity_m_s2);
  const Eigen::Matrix3d M_g = response(config.gyro);
  const Eigen::Matrix3d M_a = response(config.accel);
  const Eigen::Matrix3d G = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(config.g_sensitivity.data());

  ImuRecording recording;
  core::ImuBias bias{config.gyro_bias_rad_s, config.accel_bias_m_s2};
  // The small excess keeps the sample at duration_s itself when the product is a whole number but for rounding.
  const auto count = static_cast<std::size_t>(std::floor(duration_s * config.rate_hz + 1e-6)) + 1;
  const std::vector<bool> missing = dropouts(config, count, id);
  recording.samples.reserve(count);
  recording.stamps_ns.reserve(count);
  recording.biases.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    const core::TimeNs t_ns = core::to_ns(static_cast<double>(i) * dt);
    core::TimeNs stamp_ns = t_ns;
    if (i > 0 && i + 1 < count) {
      stamp_ns += core::to_ns(config.stamp_jitter_s * std::clamp(stamp_jitter.normal(i), -4.0, 4.0));
    }
    if (!missing[i]) {
      const Kinematics k = trajectory.at(core::to_seconds(t_ns));
      const Eigen::Vector3d f = k.T_W_B.q.conjugate() * (k.a_W - gravity_W);
      const Eigen::Vector3d w_m =
          M_g * k.omega_B + G * f + bias.gyro_rad_s + gyro_sigma.cwiseProduct(gyro_white.normal3(i));
      const Eigen::Vector3d a_m = M_a * f + bias.accel_m_s2 + accel_sigma.cwiseProduct(accel_white.normal3(i));
      recording.samples.push_back(
          {.t_ns = stamp_ns, .gyro_rad_s = read_out(config.gyro, w_m), .accel_m_s2 = read_out(config.accel, a_m)});
    }
    if (!missing[i] && !core::is_physical(recording.samples.back())) {
      throw core::RuleError(
          {"scenario.trajectory",
           fmt::format("must be slower, or the errors of scenario.imu smaller: at {} s the IMU would read more than {} "
                       "rad/s or {} m/s^2",
                       core::to_seconds(t_ns), core::kMostGyroReadingRadS, core::kMostAccelReadingMS2)});
    }
    recording.stamps_ns.push_back(stamp_ns);
    recording.biases.push_back(bias);
    bias.gyro_rad_s += noise.gyro_bias_walk * walk * gyro_walk.normal3(i);
    bias.accel_m_s2 += noise.accel_bias_walk * walk * accel_walk.normal3(i);
  }
  return recording;
}

}  // namespace plumbline::sim
