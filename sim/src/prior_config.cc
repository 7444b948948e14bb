#include "sim/prior_config.h"

#include "core/physical_ranges.h"

namespace plumbline::sim {

using core::sigma_up_to;
using core::up_to;

void visit(core::ConfigVisitor& v, PriorConfig& c) {
  v.choice("means", c.means, kPriorMeansNames,
           "`drawn`: truth plus noise of the sigmas below; `truth`: exact, and no NEES is reported");
  v.choice("start", c.start, kPriorStartNames, "where the iteration starts: at the means, or at a draw of its own");
  v.value("td_mean_s", c.td_mean_s, core::between(-1.0, 1.0), "drawn",
          "td of the middle row; with a fixed value no NEES of td is reported");
  v.value("readout_mean_s", c.readout_mean_s, core::between(0.0, 1.0), "drawn",
          "likewise of the readout; 0, and held, takes the shutter for a global one");
  v.value("td_sigma_s", c.td_sigma_s, up_to(core::kMostTimeOffsetSigmaS), "of the time offset");
  v.value("readout_sigma_s", c.readout_sigma_s, up_to(core::kMostTimeOffsetSigmaS), "of the readout");
  v.value("extrinsic_position_sigma_m", c.extrinsic_position_sigma_m, up_to(core::kMostM), "of p_B_C, each axis");
  v.value("extrinsic_rotation_sigma_rad", c.extrinsic_rotation_sigma_rad, up_to(core::kMostAngleRad),
          "of R_B_C, each axis");
  v.value("focal_sigma_px", c.focal_sigma_px, up_to(core::kMostPixels),
          "of fx and fy, at most a tenth of them; the camera that the estimator is told is the mean");
  v.value("principal_point_sigma_px", c.principal_point_sigma_px, up_to(core::kMostPixels), "of cx and cy");
  v.value("position_sigma_m", c.position_sigma_m, sigma_up_to(core::kMostM),
          "of the first state, each axis; fixes the gauge");
  v.value("orientation_sigma_rad", c.orientation_sigma_rad, sigma_up_to(core::kMostAngleRad),
          "of the first state, each axis");
  v.value("velocity_sigma_m_s", c.velocity_sigma_m_s, sigma_up_to(core::kMostSpeedMS), "of the first state, each axis");
  v.value("gyro_bias_sigma_rad_s", c.gyro_bias_sigma_rad_s, sigma_up_to(core::kMostRateRadS),
          "of the first state, each axis");
  v.value("accel_bias_sigma_m_s2", c.accel_bias_sigma_m_s2, sigma_up_to(core::kMostAccelerationMS2),
          "of the first state, each axis");
}

core::StateSigmas PriorConfig::state_sigmas() const {
  return {.position_m = position_sigma_m,
          .orientation_rad = orientation_sigma_rad,
          .velocity_m_s = velocity_sigma_m_s,
          .gyro_bias_rad_s = gyro_bias_sigma_rad_s,
          .accel_bias_m_s2 = accel_bias_sigma_m_s2};
}

core::CalibrationSigmas PriorConfig::calibration_sigmas() const {
  return {.td_s = td_sigma_s,
          .readout_s = readout_sigma_s,
          .extrinsic_position_m = extrinsic_position_sigma_m,
          .extrinsic_rotation_rad = extrinsic_rotation_sigma_rad,
          .focal_px = focal_sigma_px,
          .principal_point_px = principal_point_sigma_px};
}

}  // namespace plumbline::sim
