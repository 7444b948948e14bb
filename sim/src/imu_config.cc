#include "sim/imu_config.h"

namespace plumbline::sim {

using core::any;
using core::non_negative;

void visit(core::ConfigVisitor& v, ImuConfig& c) {
  v.value("rate_hz", c.rate_hz, core::between(10.0, 10000.0), "samples a second");
  v.value("gyro_noise_density_rad_s_sqrt_hz", c.noise.gyro_noise_density, non_negative(),
          "white noise, continuous time");
  v.value("gyro_bias_walk_rad_s2_sqrt_hz", c.noise.gyro_bias_walk, non_negative(), "random walk of the bias");
  v.value("accel_noise_density_m_s2_sqrt_hz", c.noise.accel_noise_density, non_negative(),
          "white noise, continuous time");
  v.value("accel_bias_walk_m_s3_sqrt_hz", c.noise.accel_bias_walk, non_negative(), "random walk of the bias");
  v.value("gyro_bias_rad_s", c.gyro_bias_rad_s, any(), "true bias at the start, body axes");
  v.value("accel_bias_m_s2", c.accel_bias_m_s2, any(), "true bias at the start, body axes");
}

}  // namespace plumbline::sim
