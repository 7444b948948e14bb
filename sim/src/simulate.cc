#include "sim/simulate.h"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "core/error.h"
#include "sim/camera_sensor.h"
#include "sim/imu_sensor.h"
#include "sim/line_velocity.h"
#include "sim/prior.h"
#include "sim/track_velocity.h"
#include "sim/world.h"

namespace plumbline::sim {
namespace {

// Whatever the keys add up to.
void require_finite(const std::vector<core::Frame>& frames) {
  for (const core::Frame& frame : frames) {
    const bool points_finite =
        std::all_of(frame.points.begin(), frame.points.end(), [](const core::PointObservation& p) {
          return p.pixel.allFinite() && (!p.velocity || p.velocity->allFinite());
        });
    const bool lines_finite = std::all_of(frame.lines.begin(), frame.lines.end(), [](const core::LineObservation& l) {
      const auto all_finite = [](const std::array<Eigen::Vector2d, 2>& x) {
        return x[0].allFinite() && x[1].allFinite();
      };
      return all_finite(l.ends_px) && (!l.velocities || all_finite(*l.velocities));
    });
    if (!points_finite || !lines_finite) {
      throw core::DataError(
          fmt::format("scenario.camera: the frame at {} ns has an observation that is not finite", frame.t_cam_ns));
    }
  }
}

}  // namespace

Simulation simulate(const ScenarioConfig& config, core::TrialId id) {
  const auto trajectory = make_trajectory(config.trajectory, config.duration_s, id);
  World world = make_world(config, *trajectory, id);
  ImuRecording imu = simulate_imu(*trajectory, config.imu, config.gravity_m_s2, config.duration_s, id);
  CameraRecording camera = simulate_camera(*trajectory, world, config, kCameraLeadS, id);

  Simulation s;
  s.truth.calibration = config.calibration();
  s.truth.states.reserve(imu.stamps_ns.size());
  for (std::size_t i = 0; i < imu.stamps_ns.size(); ++i) {
    const Kinematics k = trajectory->at(core::to_seconds(imu.stamps_ns[i]));
    s.truth.states.push_back({imu.stamps_ns[i], {.T_W_B = k.T_W_B, .v_W = k.v_W, .bias = imu.biases[i]}});
  }
  s.truth.landmarks_W = std::move(world.points_W);
  s.truth.track_landmark = std::move(camera.track_landmark);
  s.truth.segments_W = std::move(world.segments_W);
  s.truth.track_segment = std::move(camera.track_segment);
  s.truth.line_ends = std::move(camera.line_ends);

  core::InitialPrior prior = make_prior(s.truth, config, id);
  const core::PinholeCamera told_camera = prior.calibration.camera(config.camera.model);
  s.measurements = {.imu = std::move(imu.samples),
                    .frames = std::move(camera.frames),
                    .prior = std::move(prior),
                    .camera = told_camera,
                    .imu_noise = config.imu.noise,
                    .pixel_sigma_px = config.camera.pixel_sigma_px,
                    .line_sigma_px = config.lines.per_frame > 0 ? config.lines.sigma_px : 0.0,
                    .gravity_m_s2 = config.gravity_m_s2};
  if (config.points.velocity_source == VelocitySource::kFiniteDifference) {
    add_finite_difference_velocities(s.measurements.frames, s.measurements.camera,
                                     s.measurements.prior.calibration.readout_s);
  }
  if (config.lines.velocity_source == VelocitySource::kFiniteDifference) {
    add_finite_difference_line_velocities(s.measurements.frames, s.measurements.camera,
                                          s.measurements.prior.calibration.readout_s);
  }
  require_finite(s.measurements.frames);
  return s;
}

}  // namespace plumbline::sim
