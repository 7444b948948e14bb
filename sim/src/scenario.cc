#include "sim/scenario.h"

#include <algorithm>
#include <string>
#include <string_view>

#include "core/physical_ranges.h"

namespace plumbline::sim {

core::RigCalibration ScenarioConfig::calibration() const {
  const Eigen::Quaterniond q(Eigen::Vector4d(camera.extrinsic_rotation_xyzw));
  // A row shows the middle of its exposure, which is later than a stamp of its start.
  const double shown_s = camera.exposure_stamp == ExposureStamp::kStart ? 0.5 * camera.exposure_s : 0.0;
  return {.T_B_C = {q.normalized(), camera.extrinsic_position_m},
          .td_s = core::td_middle_from(camera.td_s, camera.readout_s, camera.td_reference_row) + shown_s,
          .readout_s = camera.readout_s,
          .intrinsics =
              prior.calibration_sigmas().has_intrinsics() ? std::optional(camera.model.intrinsics()) : std::nullopt};
}

void visit(core::ConfigVisitor& v, ScenarioConfig& c) {
  v.value("duration_s", c.duration_s, core::between(1.0, 3600.0), "of the recording, IMU clock");
  v.value("gravity_m_s2", c.gravity_m_s2, core::up_to(core::kMostGravityMS2), "along -z of the world");
  v.section("trajectory", c.trajectory, "how the body moves");
  v.section("imu", c.imu, "the inertial sensor");
  v.section("camera", c.camera, "the camera and how it is mounted");
  v.section("world", c.world, "the landmarks and segments that there are");
  v.section("points", c.points, "the tracks of landmarks");
  v.section("lines", c.lines, "the tracks of segments");
  v.section("prior", c.prior, "what the estimator is told beforehand");
}

std::optional<core::RuleViolation> validate(const ScenarioConfig& c) {
  const auto in = [](std::string_view section, std::optional<core::RuleViolation> violation) {
    if (violation) violation->key = std::string(section) + "." + violation->key;
    return violation;
  };
  if (auto violation = in("trajectory", validate(c.trajectory))) return violation;
  if (auto violation = in("imu", validate(c.imu))) return violation;
  if (auto violation = in("camera", validate(c.camera))) return violation;
  if (auto violation = in("world", validate(c.world))) return violation;
  if (auto violation = in("points", validate(c.points))) return violation;
  if (auto violation = in("lines", validate(c.lines))) return violation;
  if (c.prior.focal_sigma_px > 0.1 * std::min(c.camera.model.fx_px, c.camera.model.fy_px)) {
    return core::RuleViolation{"prior.focal_sigma_px", "must be at most a tenth of the focal lengths"};
  }
  if (c.lines.per_frame > 0 && !c.world.has_lines()) {
    return core::RuleViolation{"lines.per_frame", "must be 0 in a world without segments (world.lines)"};
  }
  return std::nullopt;
}

}  // namespace plumbline::sim
