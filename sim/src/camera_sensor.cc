#include "sim/camera_sensor.h"

#include <cmath>
#include <optional>

#include "sim/frame_view.h"

namespace plumbline::sim {

CameraRecording simulate_camera(const Trajectory& trajectory, const std::vector<Eigen::Vector3d>& landmarks,
                                const ScenarioConfig& config, double lead_s, core::TrialId id) {
  const core::RandomStream pixel_noise(id, "cam0/pixel_noise");
  const core::RandomStream loss(id, "cam0/track_loss");
  const core::RigCalibration calibration = config.calibration();
  const core::PinholeCamera& camera = config.camera.model;
  const double half_readout_s = 0.5 * std::abs(calibration.readout_s);
  const double first_s = lead_s + half_readout_s - calibration.td_s;
  const double last_s = config.duration_s - lead_s - half_readout_s - calibration.td_s;

  struct Track {
    std::int64_t id;
    int landmark;
    int frames;
  };
  CameraRecording recording;
  std::vector<Track> tracks;
  std::vector<char> tracked(landmarks.size(), 0);
  std::int64_t next_id = 0;

  const auto first_frame = static_cast<std::int64_t>(std::ceil(first_s * config.camera.rate_hz));
  const auto last_frame = static_cast<std::int64_t>(std::floor(last_s * config.camera.rate_hz));
  for (std::int64_t n = first_frame; n <= last_frame; ++n) {
    const core::TimeNs t_cam_ns = core::to_ns(static_cast<double>(n) / config.camera.rate_hz);
    const FrameView view(trajectory, camera, calibration, core::to_seconds(t_cam_ns));
    const auto frame_index = static_cast<std::uint64_t>(n - first_frame);
    core::Frame frame{.t_cam_ns = t_cam_ns, .points = {}};

    // Of a landmark that is in the picture and in range, without noise.
    const auto visible = [&](int landmark) -> std::optional<Exposure> {
      const Eigen::Vector3d& P_W = landmarks[static_cast<std::size_t>(landmark)];
      if (!view.may_see(P_W, config.points.nearest_m, config.points.farthest_m)) return std::nullopt;
      const auto exposure = view.expose(P_W);
      if (!exposure || !camera.contains(exposure->pixel)) return std::nullopt;
      if (exposure->depth_m < config.points.nearest_m || exposure->depth_m > config.points.farthest_m) {
        return std::nullopt;
      }
      return exposure;
    };
    const auto observe = [&](const Track& track, const Exposure& exposure) {
      const auto landmark = static_cast<std::uint64_t>(track.landmark);
      core::PointObservation& point = frame.points.emplace_back();
      point.track_id = track.id;
      point.pixel = exposure.pixel + config.camera.pixel_sigma_px * pixel_noise.normal2(frame_index, landmark);
      if (config.points.velocity_source == VelocitySource::kExact) {
        point.velocity = view.image_velocity(landmarks[static_cast<std::size_t>(track.landmark)], exposure.t_imu_s);
      }
    };

    std::vector<Track> continued;
    const auto end_track = [&](const Track& track) { tracked[static_cast<std::size_t>(track.landmark)] = 0; };
    for (Track& track : tracks) {
      const bool lost =
          loss.uniform(frame_index, static_cast<std::uint64_t>(track.landmark)) < config.points.loss_probability;
      const bool too_long =
          config.points.longest_track_frames > 0 && track.frames >= config.points.longest_track_frames;
      const auto exposure = lost || too_long ? std::nullopt : visible(track.landmark);
      if (!exposure) {
        end_track(track);
        continue;
      }
      ++track.frames;
      observe(track, *exposure);
      continued.push_back(track);
    }
    const auto wanted = static_cast<std::size_t>(config.points.per_frame);
    for (int landmark = 0; landmark < static_cast<int>(landmarks.size()) && continued.size() < wanted; ++landmark) {
      if (tracked[static_cast<std::size_t>(landmark)] != 0) continue;
      const auto exposure = visible(landmark);
      if (!exposure) continue;
      const Track track{.id = next_id++, .landmark = landmark, .frames = 1};
      tracked[static_cast<std::size_t>(landmark)] = 1;
      recording.track_landmark.emplace(track.id, landmark);
      observe(track, *exposure);
      continued.push_back(track);
    }
    tracks = std::move(continued);
    recording.frames.push_back(std::move(frame));
  }
  return recording;
}

}  // namespace plumbline::sim
