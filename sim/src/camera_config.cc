#include "sim/camera_config.h"

#include <cmath>

#include "core/camera_config.h"
#include "core/physical_ranges.h"

namespace plumbline::sim {

using core::at_least;
using core::positive_up_to;
using core::probability;
using core::up_to;

void visit(core::ConfigVisitor& v, CameraConfig& c) {
  v.value("rate_hz", c.rate_hz, core::between(0.1, 1000.0), "frames a second");
  core::visit(v, c.model);
  v.value("td_s", c.td_s, core::between(-1.0, 1.0), "time offset, t_imu = t_cam + td");
  v.choice("td_reference_row", c.td_reference_row, core::kRowReferenceNames, "the row that td_s speaks of");
  v.value("readout_s", c.readout_s, core::between(0.0, 1.0), "from the first row to the last; 0 is a global shutter");
  v.value("exposure_s", c.exposure_s, core::between(0.0, 1.0), "of a row");
  v.choice("exposure_stamp", c.exposure_stamp, kExposureStampNames,
           "what stamps refer to; with `start` td is td_s + exposure_s / 2, since a row shows its mid exposure");
  v.value("trigger_jitter_s", c.trigger_jitter_s, core::between(0.0, 0.02),
          "sigma of the true frame times, which the stamps follow; cut at 4 sigma");
  v.value("stamp_jitter_s", c.stamp_jitter_s, core::between(0.0, 0.02),
          "sigma of the stamps about the true frame times; cut at 4 sigma");
  v.value("drop_probability", c.drop_probability, probability(), "that a frame is lost; its tracks run on");
  v.value("pixel_sigma_px", c.pixel_sigma_px, up_to(core::kMostPixels), "noise of u and v");
  v.value("pixel_noise_dof", c.pixel_noise_dof, core::Range{.lower = 2.0, .upper = 1e6, .lower_open = true}, "normal",
          "Student's t of so many degrees of freedom, of the same variance");
  v.value("pixel_noise_correlation", c.pixel_noise_correlation,
          core::Range{.lower = 0.0, .upper = 1.0, .upper_open = true},
          "of the noise of a track in consecutive frames, first-order autoregressive");
  v.value("gross_outlier_probability", c.gross_outlier_probability, probability(), "that an observation is far off");
  v.value("gross_outlier_sigma_px", c.gross_outlier_sigma_px, up_to(core::kMostPixels),
          "how far, u and v, on top of the noise");
  v.value("uniform_outlier_probability", c.uniform_outlier_probability, probability(),
          "that an observation is anywhere in the picture");
  v.value("extrinsic_position_m", c.extrinsic_position_m, core::within(core::kMostM), "p_B_C, the camera in the body");
  v.value("extrinsic_rotation_xyzw", c.extrinsic_rotation_xyzw, core::between(-1.0, 1.0),
          "R_B_C as a unit quaternion; the default looks along the body's x axis");
}

void visit(core::ConfigVisitor& v, PointsConfig& c) {
  v.value("per_frame", c.per_frame, core::between(0, 100000), "most points that a frame tracks");
  v.value("nearest_m", c.nearest_m, positive_up_to(core::kMostPathM), "smallest depth that is tracked");
  v.value("farthest_m", c.farthest_m, positive_up_to(core::kMostPathM), "largest depth that is tracked");
  v.value("loss_probability", c.loss_probability, probability(), "that a track ends at a frame");
  v.value("longest_track_frames", c.longest_track_frames, at_least(0), "a track ends after as many; 0 is no limit");
  v.choice("velocity_source", c.velocity_source, kVelocitySourceNames,
           "of the image velocities: a tracker's, from the noisy pixels of consecutive frames; the truth; or absent");
}

std::optional<core::RuleViolation> validate(const CameraConfig& c) {
  if (std::abs(c.extrinsic_rotation_xyzw.norm() - 1.0) > 1e-3) {
    return core::RuleViolation{"extrinsic_rotation_xyzw", "must be a unit quaternion"};
  }
  // Four sigma of both must leave the frames in order.
  if ((c.trigger_jitter_s + c.stamp_jitter_s) * c.rate_hz > 0.1) {
    const bool trigger = c.trigger_jitter_s > c.stamp_jitter_s;
    return core::RuleViolation{trigger ? "trigger_jitter_s" : "stamp_jitter_s",
                               "must be <= a tenth of the interval, 0.1 / rate_hz, both jitters together"};
  }
  if (c.exposure_s * c.rate_hz > 1.0) return core::RuleViolation{"exposure_s", "must be <= 1 / rate_hz"};
  return core::validate(c.model);
}

std::optional<core::RuleViolation> validate(const PointsConfig& c) {
  if (c.farthest_m < c.nearest_m) return core::RuleViolation{"farthest_m", "must be >= nearest_m"};
  return std::nullopt;
}

}  // namespace plumbline::sim
