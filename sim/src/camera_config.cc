#include "sim/camera_config.h"

#include <cmath>

namespace plumbline::sim {

using core::any;
using core::at_least;
using core::non_negative;
using core::positive;
using core::probability;

void visit(core::ConfigVisitor& v, CameraConfig& c) {
  v.value("rate_hz", c.rate_hz, core::between(0.1, 1000.0), "frames a second");
  v.value("width_px", c.model.width_px, at_least(1), "columns");
  v.value("height_px", c.model.height_px, at_least(1), "rows");
  v.value("fx_px", c.model.fx_px, positive(), "focal length, horizontal");
  v.value("fy_px", c.model.fy_px, positive(), "focal length, vertical");
  v.value("cx_px", c.model.cx_px, any(), "principal point; (0, 0) is the centre of the upper left pixel");
  v.value("cy_px", c.model.cy_px, any(), "principal point");
  v.value("td_s", c.td_s, core::between(-1.0, 1.0), "time offset, t_imu = t_cam + td");
  v.choice("td_reference_row", c.td_reference_row, core::kRowReferenceNames, "the row that td_s speaks of");
  v.value("readout_s", c.readout_s, core::between(0.0, 1.0), "from the first row to the last; 0 is a global shutter");
  v.value("pixel_sigma_px", c.pixel_sigma_px, non_negative(), "Gaussian noise of u and v");
  v.value("extrinsic_position_m", c.extrinsic_position_m, any(), "p_B_C, the camera in the body");
  v.value("extrinsic_rotation_xyzw", c.extrinsic_rotation_xyzw, core::between(-1.0, 1.0),
          "R_B_C as a unit quaternion; the default looks along the body's x axis");
}

void visit(core::ConfigVisitor& v, PointsConfig& c) {
  v.value("per_frame", c.per_frame, core::between(0, 100000), "most points that a frame tracks");
  v.value("nearest_m", c.nearest_m, positive(), "smallest depth that is tracked");
  v.value("farthest_m", c.farthest_m, positive(), "largest depth that is tracked");
  v.value("loss_probability", c.loss_probability, probability(), "that a track ends at a frame");
  v.value("longest_track_frames", c.longest_track_frames, at_least(0), "a track ends after as many; 0 is no limit");
  v.choice("velocity_source", c.velocity_source, kVelocitySourceNames,
           "of the image velocities: a tracker's, from the noisy pixels of consecutive frames; the truth; or absent");
}

std::optional<core::RuleViolation> validate(const CameraConfig& c) {
  if (std::abs(c.extrinsic_rotation_xyzw.norm() - 1.0) > 1e-3) {
    return core::RuleViolation{"extrinsic_rotation_xyzw", "must be a unit quaternion"};
  }
  return std::nullopt;
}

std::optional<core::RuleViolation> validate(const PointsConfig& c) {
  if (c.farthest_m < c.nearest_m) return core::RuleViolation{"farthest_m", "must be >= nearest_m"};
  return std::nullopt;
}

}  // namespace plumbline::sim
