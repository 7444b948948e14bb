// Which frames enter the estimate, and the tracks of points and lines through them.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "core/measurements.h"

namespace plumbline::estimator {

// Indices of the frames at a rate of at most rate_hz: of each period, counted from the first frame, the first frame.
std::vector<std::size_t> select_keyframes(const std::vector<core::Frame>& frames, double rate_hz);

struct TrackObservation {
  std::size_t keyframe = 0;  // index into the selection
  Eigen::Vector2d pixel;
  std::optional<Eigen::Vector2d> velocity = std::nullopt;  // of the normalised coordinates, 1/s
};

struct LineTrackObservation {
  std::size_t keyframe = 0;  // index into the selection
  std::array<Eigen::Vector2d, 2> ends_px;
  std::optional<std::array<Eigen::Vector2d, 2>> velocities = std::nullopt;  // of the normalised coordinates, 1/s
};

// The first observation is the anchor's.
template <class Observation>
struct TrackOf {
  std::int64_t id = 0;
  std::vector<Observation> observations;
};
using Track = TrackOf<TrackObservation>;
using LineTrack = TrackOf<LineTrackObservation>;

// Tracks that at least two keyframes see (a point that is seen once says nothing of the motion), by their ids. Without
// the observations at pixels that no ray of the camera falls on.
std::vector<Track> collect_tracks(const std::vector<core::Frame>& frames, const std::vector<std::size_t>& keyframes,
                                  const core::PinholeCamera& camera);

// Likewise of lines; an observation needs a ray at both ends.
std::vector<LineTrack> collect_line_tracks(const std::vector<core::Frame>& frames,
                                           const std::vector<std::size_t>& keyframes,
                                           const core::PinholeCamera& camera);

// Leaves out the observations without an image velocity, and with them the tracks that fewer than two are left of:
// taking 0 for a velocity that is not known would be a wrong one. Returns how many observations had none.
int drop_without_velocity(std::vector<Track>& tracks);
int drop_without_velocity(std::vector<LineTrack>& tracks);

}  // namespace plumbline::estimator
