// Follows segments from frame to frame. A segment is one track, or, once broken at a place of it, two that meet there:
//   whole -> parts   by chance (fragment_probability a frame), at 20 to 80 % of what is seen; the longer part keeps
//                    the track, the other begins one
//   parts -> whole   by chance (merge_probability a frame), under the older track; or when neither part is tracked
// Draws are indexed by frame and segment, so that none changes another.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/random.h"
#include "sim/lines_config.h"
#include "sim/segment_sight.h"

namespace plumbline::sim {

// What a frame shows of a line track.
struct LineSighting {
  std::int64_t track_id = 0;
  int segment = 0;
  std::uint64_t draw = 0;  // the index of its draws: 2 segment + (1 for its second part)
  VisiblePiece piece;
};

class LineTracker {
 public:
  LineTracker(const World& world, const core::PinholeCamera& camera, const LinesConfig& config, core::TrialId id);

  // What the next frame shows: the tracks of the last one that are still visible and long enough, then segments in
  // their order up to per_frame.
  std::vector<LineSighting> advance(const FrameView& view, std::uint64_t frame_index);

 private:
  struct Track {
    std::int64_t id = 0;
    int frames = 0;
  };
  // Of a segment. The whole is the first of its parts.
  struct Tracks {
    std::optional<double> broken_at;
    std::array<std::optional<Track>, 2> parts;
    std::optional<VisiblePiece> piece;  // what the frame shows of the segment, where it was looked for

    bool any() const { return parts[0] || parts[1]; }
  };

  void go_on(std::size_t segment, const FrameView& view, std::uint64_t frame_index,
             std::vector<LineSighting>& sightings);
  void begin(std::size_t segment, const FrameView& view, std::vector<LineSighting>& sightings);
  void break_or_merge(std::size_t segment, std::uint64_t frame_index);
  bool ends(const Track& track, std::uint64_t draw, std::uint64_t frame_index) const;
  std::optional<VisiblePiece> visible_part(std::size_t segment, std::size_t part, const FrameView& view) const;

  const std::vector<Segment>& segments_W_;
  const LinesConfig& config_;
  SegmentSight sight_;
  core::RandomStream loss_;
  core::RandomStream break_;
  std::vector<Tracks> tracks_;  // by segment
  std::int64_t next_id_ = 0;
};

}  // namespace plumbline::sim
