// A dataset to be exported, of a rig all of whose numbers are decimals.
#pragma once

#include <filesystem>
#include <stdexcept>
#include <string>

#include <gtest/gtest.h>

#include "program_test.h"
#include "tools/experiment.h"

namespace plumbline {

class Interoperability : public ProgramTest {
 protected:
  // A dataset of a rig all of whose numbers are decimals; what its estimator is told is the truth.
  void simulate(const std::string& lens) const {
    write("scenario.yaml", R"(duration_s: 2
gravity_m_s2: 9.80665
imu: {rate_hz: 250, gyro_noise_density_rad_s_sqrt_hz: 1.7e-4, gyro_bias_walk_rad_s2_sqrt_hz: 2.3e-5,
      accel_noise_density_m_s2_sqrt_hz: 2.1e-3, accel_bias_walk_m_s3_sqrt_hz: 3.7e-4}
camera: {rate_hz: 20, width_px: 752, height_px: 478, fx_px: 458.654, fy_px: 457.296, cx_px: 367.215, cy_px: 248.375,
         td_s: 0.0123, readout_s: 0.0271, pixel_sigma_px: 0.7, extrinsic_position_m: [0.0613, -0.0217, 0.0098],
         extrinsic_rotation_xyzw: [-0.46, 0.54, -0.54, 0.452990066116245], )" +
                               lens + R"(}
world: {landmarks: 50}
points: {per_frame: 5}
prior: {means: truth}
)");
    std::filesystem::remove_all(folder_ / "data");
    ASSERT_EQ(plumbline("simulate scenario.yaml --out data").code, 0);
  }

  sim::ScenarioConfig scenario(const std::string& file) const { return tools::load_scenario(folder_ / file, {}); }

  // Of `name: NUMBER` in a file.
  double number_in(const std::string& file, const std::string& name) const {
    const std::string text = read(folder_ / file);
    const std::size_t at = text.find("\n" + name + ": ");
    if (at == std::string::npos) throw std::runtime_error(file + " has no " + name);
    return std::stod(text.substr(at + name.size() + 3));
  }
};

}  // namespace plumbline
