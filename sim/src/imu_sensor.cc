#include "sim/imu_sensor.h"

#include <cmath>

namespace plumbline::sim {

ImuRecording simulate_imu(const Trajectory& trajectory, const ImuConfig& config, double gravity_m_s2, double duration_s,
                          core::TrialId id) {
  const core::RandomStream gyro_white(id, "imu0/gyro_white");
  const core::RandomStream accel_white(id, "imu0/accel_white");
  const core::RandomStream gyro_walk(id, "imu0/gyro_walk");
  const core::RandomStream accel_walk(id, "imu0/accel_walk");
  const double dt = 1.0 / config.rate_hz;
  const double white = 1.0 / std::sqrt(dt);
  const double walk = std::sqrt(dt);
  const Eigen::Vector3d gravity_W(0.0, 0.0, -gravity_m_s2);
  const core::ImuNoise& noise = config.noise;

  ImuRecording recording;
  core::ImuBias bias{config.gyro_bias_rad_s, config.accel_bias_m_s2};
  // The small excess keeps the sample at duration_s itself when the product is a whole number but for rounding.
  const auto count = static_cast<std::uint64_t>(std::floor(duration_s * config.rate_hz + 1e-6)) + 1;
  recording.samples.reserve(count);
  recording.biases.reserve(count);
  for (std::uint64_t i = 0; i < count; ++i) {
    const core::TimeNs t_ns = core::to_ns(static_cast<double>(i) * dt);
    const Kinematics k = trajectory.at(core::to_seconds(t_ns));
    recording.samples.push_back(
        {.t_ns = t_ns,
         .gyro_rad_s = k.omega_B + bias.gyro_rad_s + noise.gyro_noise_density * white * gyro_white.normal3(i),
         .accel_m_s2 = k.T_W_B.q.conjugate() * (k.a_W - gravity_W) + bias.accel_m_s2 +
                       noise.accel_noise_density * white * accel_white.normal3(i)});
    recording.biases.push_back(bias);
    bias.gyro_rad_s += noise.gyro_bias_walk * walk * gyro_walk.normal3(i);
    bias.accel_m_s2 += noise.accel_bias_walk * walk * accel_walk.normal3(i);
  }
  return recording;
}

}  // namespace plumbline::sim
