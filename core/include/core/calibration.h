// What relates the sensors of a rig: extrinsics, time offset, readout, noise.
//
// Time offset:      t_imu = t_cam + td
// Rolling shutter:  the row v of a frame stamped t_cam is exposed at
//                   t_imu(v) = t_cam + td + (v - v_ref) * readout_s / rows,   v_ref = rows/2 (`middle`) or 0 (`first`)
// Inside Plumbline td is always that of the middle row; td_middle = td_first + readout/2.
#pragma once

#include <array>
#include <optional>
#include <string_view>

#include "core/camera.h"
#include "core/lie.h"

namespace plumbline::core {

enum class RowReference { kMiddle, kFirst };
inline constexpr std::array<std::string_view, 2> kRowReferenceNames = {"middle", "first"};

// td of the middle row from a td that is stated for `reference`.
inline double td_middle_from(double td_s, double readout_s, RowReference reference) {
  return reference == RowReference::kMiddle ? td_s : td_s + 0.5 * readout_s;
}

// The share of the readout, in [-1/2, 1/2], between the middle row and row v.
inline double row_phase(double v_px, int rows) { return (v_px - 0.5 * rows) / rows; }

struct RigCalibration {
  Pose T_B_C;
  double td_s = 0.0;       // middle row
  double readout_s = 0.0;  // first row to last; 0 for a global shutter, and an estimate may be negative
  // Where the camera's are not exactly known; else those of the camera model hold.
  std::optional<Intrinsics> intrinsics = std::nullopt;

  PinholeCamera camera(const PinholeCamera& model) const { return intrinsics ? model.with(*intrinsics) : model; }
};

// Continuous-time densities: a sample at interval dt has white noise sigma/sqrt(dt), a bias step sigma_b*sqrt(dt).
struct ImuNoise {
  double gyro_noise_density = 0.0;   // rad/s/sqrt(Hz)
  double gyro_bias_walk = 0.0;       // rad/s^2/sqrt(Hz)
  double accel_noise_density = 0.0;  // m/s^2/sqrt(Hz)
  double accel_bias_walk = 0.0;      // m/s^3/sqrt(Hz)
};

}  // namespace plumbline::core
