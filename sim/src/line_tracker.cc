#include "sim/line_tracker.h"

#include <utility>

namespace plumbline::sim {
namespace {

std::uint64_t draw_index(std::size_t segment, std::size_t part) { return 2 * segment + part; }

}  // namespace

LineTracker::LineTracker(const World& world, const core::PinholeCamera& camera, const LinesConfig& config,
                         core::TrialId id)
    : segments_W_(world.segments_W),
      config_(config),
      sight_(world, camera, config.nearest_m, config.farthest_m),
      loss_(id, "cam0/line_loss"),
      break_(id, "cam0/line_break"),
      tracks_(world.segments_W.size()) {}

std::vector<LineSighting> LineTracker::advance(const FrameView& view, std::uint64_t frame_index) {
  std::vector<LineSighting> sightings;
  for (std::size_t segment = 0; segment < tracks_.size(); ++segment) go_on(segment, view, frame_index, sightings);
  for (std::size_t segment = 0; segment < tracks_.size(); ++segment) begin(segment, view, sightings);
  return sightings;
}

void LineTracker::go_on(std::size_t segment, const FrameView& view, std::uint64_t frame_index,
                        std::vector<LineSighting>& sightings) {
  Tracks& tracks = tracks_[segment];
  tracks.piece.reset();
  if (!tracks.any()) return;
  tracks.piece = sight_.longest_visible(view, segments_W_[segment]);
  break_or_merge(segment, frame_index);
  for (const std::size_t part : {std::size_t{0}, std::size_t{1}}) {
    std::optional<Track>& track = tracks.parts[part];
    if (!track) continue;
    const std::uint64_t draw = draw_index(segment, part);
    const auto piece = visible_part(segment, part, view);
    if (!piece || ends(*track, draw, frame_index)) {
      track.reset();
      continue;
    }
    ++track->frames;
    sightings.push_back({.track_id = track->id, .segment = static_cast<int>(segment), .draw = draw, .piece = *piece});
  }
}

void LineTracker::begin(std::size_t segment, const FrameView& view, std::vector<LineSighting>& sightings) {
  const auto wanted = static_cast<std::size_t>(config_.per_frame);
  Tracks& tracks = tracks_[segment];
  if (!tracks.any()) tracks.broken_at.reset();
  const std::size_t parts = tracks.broken_at ? 2 : 1;
  for (std::size_t part = 0; part < parts && sightings.size() < wanted; ++part) {
    if (tracks.parts[part]) continue;
    if (!tracks.piece) tracks.piece = sight_.longest_visible(view, segments_W_[segment]);
    const auto piece = visible_part(segment, part, view);
    if (!piece) continue;
    const Track track{.id = next_id_++, .frames = 1};
    tracks.parts[part] = track;
    sightings.push_back({.track_id = track.id,
                         .segment = static_cast<int>(segment),
                         .draw = draw_index(segment, part),
                         .piece = *piece});
  }
}

void LineTracker::break_or_merge(std::size_t segment, std::uint64_t frame_index) {
  Tracks& tracks = tracks_[segment];
  auto& [first, second] = tracks.parts;
  const auto u = break_.uniforms(frame_index, segment);
  if (tracks.broken_at) {
    if (u[0] >= config_.merge_probability) return;
    tracks.broken_at.reset();
    if (!first || (second && second->id < first->id)) first = second;
    second.reset();
  } else if (tracks.piece && u[0] < config_.fragment_probability) {
    const double share = 0.2 + 0.6 * u[1];
    tracks.broken_at = at_image_share(*tracks.piece, share);
    if (share < 0.5) std::swap(first, second);
  }
}

bool LineTracker::ends(const Track& track, std::uint64_t draw, std::uint64_t frame_index) const {
  if (config_.longest_track_frames > 0 && track.frames >= config_.longest_track_frames) return true;
  return loss_.uniform(frame_index, draw) < config_.loss_probability;
}

// Nothing where it is too short.
std::optional<VisiblePiece> LineTracker::visible_part(std::size_t segment, std::size_t part,
                                                      const FrameView& view) const {
  const Tracks& tracks = tracks_[segment];
  std::optional<VisiblePiece> result = tracks.piece;
  if (!result) return std::nullopt;
  if (tracks.broken_at) {
    const double s = *tracks.broken_at;
    const auto& [from, to] = tracks.piece->ends;
    const bool beyond = part == 0 ? s <= from.s : s >= to.s;
    if (beyond) return std::nullopt;
    if (s > from.s && s < to.s) {
      const auto exposure = view.expose(segments_W_[segment].at(s));
      if (!exposure) return std::nullopt;
      result->ends[1 - part] = {s, *exposure};
    }
  }
  if (!(result->length_px() >= config_.shortest_px)) return std::nullopt;
  return result;
}

}  // namespace plumbline::sim
