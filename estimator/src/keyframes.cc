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

namespace {

// Tracks of two observations or more. visit(frame, add) calls add(track_id, observation) for each of a frame's.
template <class Observation, class Visit>
std::vector<TrackOf<Observation>> collect(const std::vector<core::Frame>& frames,
                                          const std::vector<std::size_t>& keyframes, const Visit& visit) {
  std::map<std::int64_t, TrackOf<Observation>> by_id;
  for (std::size_t k = 0; k < keyframes.size(); ++k) {
    visit(frames[keyframes[k]], [&](std::int64_t id, Observation observation) {
      TrackOf<Observation>& track = by_id[id];
      track.id = id;
      observation.keyframe = k;
      track.observations.push_back(std::move(observation));
    });
  }
  std::vector<TrackOf<Observation>> tracks;
  for (auto& [id, track] : by_id) {
    if (track.observations.size() >= 2) tracks.push_back(std::move(track));
  }
  return tracks;
}

template <class Observation>
std::size_t drop_if(std::vector<TrackOf<Observation>>& tracks, bool (*unusable)(const Observation&)) {
  std::size_t dropped = 0;
  for (auto& track : tracks) dropped += std::erase_if(track.observations, unusable);
  std::erase_if(tracks, [](const TrackOf<Observation>& track) { return track.observations.size() < 2; });
  return dropped;
}

}  // namespace

std::vector<Track> collect_tracks(const std::vector<core::Frame>& frames, const std::vector<std::size_t>& keyframes,
                                  const core::PinholeCamera& camera) {
  return collect<TrackObservation>(frames, keyframes, [&](const core::Frame& frame, const auto& add) {
    for (const core::PointObservation& point : frame.points) {
      if (camera.try_unproject(point.pixel)) add(point.track_id, TrackObservation{0, point.pixel, point.velocity});
    }
  });
}

std::vector<LineTrack> collect_line_tracks(const std::vector<core::Frame>& frames,
                                           const std::vector<std::size_t>& keyframes,
                                           const core::PinholeCamera& camera) {
  return collect<LineTrackObservation>(frames, keyframes, [&](const core::Frame& frame, const auto& add) {
    for (const core::LineObservation& line : frame.lines) {
      if (!camera.try_unproject(line.ends_px[0]) || !camera.try_unproject(line.ends_px[1])) continue;
      add(line.track_id, LineTrackObservation{0, line.ends_px, line.velocities});
    }
  });
}

int drop_without_velocity(std::vector<Track>& tracks) {
  return static_cast<int>(
      drop_if<TrackObservation>(tracks, [](const TrackObservation& o) { return !o.velocity.has_value(); }));
}

int drop_without_velocity(std::vector<LineTrack>& tracks) {
  return static_cast<int>(
      drop_if<LineTrackObservation>(tracks, [](const LineTrackObservation& o) { return !o.velocities.has_value(); }));
}

}  // namespace plumbline::estimator
