#include "estimator/keyframes.h"

#include <cmath>
#include <map>
#include <utility>

namespace plumbline::estimator {

std::vector<std::size_t> select_keyframes(const std::vector<core::Frame>& frames, double rate_hz) {
  // Stamps are rounded to nanoseconds; a frame this little before its period belongs to it.
  constexpr double kToleranceS = 1e-6;
  std::vector<std::size_t> keyframes;
  double next_period = 0.0;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const double periods = (core::to_seconds(frames[i].t_cam_ns - frames.front().t_cam_ns) + kToleranceS) * rate_hz;
    if (periods < next_period) continue;
    keyframes.push_back(i);
    next_period = std::floor(periods) + 1.0;
  }
  return keyframes;
}

std::vector<Track> collect_tracks(const std::vector<core::Frame>& frames, const std::vector<std::size_t>& keyframes,
                                  const core::PinholeCamera& camera) {
  std::map<std::int64_t, Track> by_id;
  for (std::size_t k = 0; k < keyframes.size(); ++k) {
    for (const core::PointObservation& point : frames[keyframes[k]].points) {
      if (!camera.try_unproject(point.pixel)) continue;
      Track& track = by_id[point.track_id];
      track.id = point.track_id;
      track.observations.push_back({k, point.pixel, point.velocity});
    }
  }
  std::vector<Track> tracks;
  for (auto& [id, track] : by_id) {
    if (track.observations.size() >= 2) tracks.push_back(std::move(track));
  }
  return tracks;
}

int drop_without_velocity(std::vector<Track>& tracks) {
  std::size_t dropped = 0;
  for (Track& track : tracks) {
    dropped += std::erase_if(track.observations, [](const TrackObservation& o) { return !o.velocity; });
  }
  std::erase_if(tracks, [](const Track& track) { return track.observations.size() < 2; });
  return static_cast<int>(dropped);
}

}  // namespace plumbline::estimator
