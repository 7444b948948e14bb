#include "sim/camera_sensor.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "sim/frame_view.h"
#include "sim/line_sensor.h"
#include "sim/pixel_noise.h"

namespace plumbline::sim {
namespace {

struct Track {
  std::int64_t id = 0;
  int landmark = 0;
  int frames = 0;
  std::optional<Eigen::Vector2d> error_px;  // of its last frame
  Exposure exposure;                        // likewise
};

// Follows landmarks from frame to frame.
class Tracker {
 public:
  Tracker(const World& world, const ScenarioConfig& config, core::TrialId id)
      : world_(world), config_(config), loss_(id, "cam0/track_loss"), tracked_(world.points_W.size(), 0) {}

  // The tracks that the next frame holds.
  std::vector<Track>& advance(const FrameView& view, std::uint64_t frame_index) {
    std::vector<Track> continued;
    for (Track& track : tracks_) {
      const auto exposure = ends(track, frame_index)
                                ? std::nullopt
                                : sees(view, world_.points_W[static_cast<std::size_t>(track.landmark)]);
      if (!exposure) {
        tracked_[static_cast<std::size_t>(track.landmark)] = 0;
        continue;
      }
      ++track.frames;
      track.exposure = *exposure;
      continued.push_back(track);
    }
    const auto wanted = static_cast<std::size_t>(config_.points.per_frame);
    for (std::size_t landmark = 0; landmark < tracked_.size() && continued.size() < wanted; ++landmark) {
      if (tracked_[landmark] != 0) continue;
      const auto exposure = sees(view, world_.points_W[landmark]);
      if (!exposure) continue;
      tracked_[landmark] = 1;
      continued.push_back({.id = next_id_++,
                           .landmark = static_cast<int>(landmark),
                           .frames = 1,
                           .error_px = std::nullopt,
                           .exposure = *exposure});
    }
    tracks_ = std::move(continued);
    return tracks_;
  }

 private:
  bool ends(const Track& track, std::uint64_t frame_index) const {
    const PointsConfig& points = config_.points;
    if (points.longest_track_frames > 0 && track.frames >= points.longest_track_frames) return true;
    return loss_.uniform(frame_index, static_cast<std::uint64_t>(track.landmark)) < points.loss_probability;
  }

  // A landmark that is in the picture, in range and not hidden, without noise.
  std::optional<Exposure> sees(const FrameView& view, const Eigen::Vector3d& P_W) const {
    const PointsConfig& points = config_.points;
    if (!view.may_see(P_W, points.nearest_m, points.farthest_m)) return std::nullopt;
    auto exposure = view.expose(P_W);
    if (!exposure || !config_.camera.model.contains(exposure->pixel)) return std::nullopt;
    if (exposure->depth_m < points.nearest_m || exposure->depth_m > points.farthest_m) return std::nullopt;
    if (world_.occluded(exposure->camera_W, P_W)) return std::nullopt;
    return exposure;
  }

  const World& world_;
  const ScenarioConfig& config_;
  core::RandomStream loss_;
  std::vector<Track> tracks_;
  std::vector<char> tracked_;
  std::int64_t next_id_ = 0;
};

double cut_normal(const core::RandomStream& stream, std::uint64_t index) {
  return std::clamp(stream.normal(index), -4.0, 4.0);
}

void record(const std::vector<LineReport>& reports, core::Frame& frame, CameraRecording& recording) {
  for (const LineReport& r : reports) {
    const auto& [first, second] = r.ends;
    frame.lines.push_back(r.observation);
    recording.track_segment.emplace(r.observation.track_id, r.track_segment);
    recording.line_ends.push_back({.frame_ns = frame.t_cam_ns,
                                   .track_id = r.observation.track_id,
                                   .segment = r.segment,
                                   .t_imu_s = {first.exposure.t_imu_s, second.exposure.t_imu_s},
                                   .ends_px = {first.exposure.pixel, second.exposure.pixel}});
  }
}

}  // namespace

CameraRecording simulate_camera(const Trajectory& trajectory, const World& world, const ScenarioConfig& config,
                                double lead_s, core::TrialId id) {
  const core::RandomStream trigger_jitter(id, "cam0/trigger_jitter");
  const core::RandomStream stamp_jitter(id, "cam0/stamp_jitter");
  const core::RandomStream drop(id, "cam0/frame_drop");
  const CameraConfig& camera = config.camera;
  const PixelNoise noise(camera, id);
  const core::RigCalibration calibration = config.calibration();
  const double half_angle_rad = half_angle_of_view_rad(camera.model);
  const double half_readout_s = 0.5 * std::abs(calibration.readout_s);
  const double first_s = lead_s + half_readout_s - calibration.td_s;
  const double last_s = config.duration_s - lead_s - half_readout_s - calibration.td_s;

  CameraRecording recording;
  Tracker tracker(world, config, id);
  LineSensor lines(world, config, id);
  const auto first_frame = static_cast<std::int64_t>(std::ceil(first_s * camera.rate_hz));
  const auto last_frame = static_cast<std::int64_t>(std::floor(last_s * camera.rate_hz));
  for (std::int64_t n = first_frame; n <= last_frame; ++n) {
    // By the trigger's number and not by the recording's first: a frame's draws are the same whatever td, readout and
    // exposure leave out before it. Negative numbers wrap around.
    const auto index = static_cast<std::uint64_t>(n);
    const core::TimeNs trigger_ns = core::to_ns(static_cast<double>(n) / camera.rate_hz +
                                                camera.trigger_jitter_s * cut_normal(trigger_jitter, index));
    const FrameView view(trajectory, camera.model, calibration, half_angle_rad, core::to_seconds(trigger_ns));
    core::Frame frame{.t_cam_ns = trigger_ns + core::to_ns(camera.stamp_jitter_s * cut_normal(stamp_jitter, index)),
                      .points = {}};
    const bool dropped = drop.uniform(index) < camera.drop_probability;

    for (Track& track : tracker.advance(view, index)) {
      const auto landmark = static_cast<std::uint64_t>(track.landmark);
      track.error_px = noise.next_error(track.error_px, index, landmark);
      if (dropped) continue;
      core::PointObservation& point = frame.points.emplace_back();
      point.track_id = track.id;
      point.pixel = noise.spoil(track.exposure.pixel + *track.error_px, index, landmark);
      if (config.points.velocity_source == VelocitySource::kExact) {
        point.velocity = view.image_velocity(world.points_W[landmark], track.exposure.t_imu_s);
      }
      recording.track_landmark.emplace(track.id, track.landmark);
    }
    const std::vector<LineReport> reports = lines.observe(view, index);
    if (dropped) continue;
    record(reports, frame, recording);
    recording.frames.push_back(std::move(frame));
  }
  return recording;
}

}  // namespace plumbline::sim
