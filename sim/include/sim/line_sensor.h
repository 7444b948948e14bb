// What a detector of segments reports, frame by frame, and what is wrong with it. h_k is the noise-free pixel of an
// end, exposed with its own row:
//   z_k = h_k + n_k,  n_k ~ N(0, sigma^2 I), k = 0, 1 in the order of the segment's own ends
//   slide: either end is not that of what is seen (sim/segment_sight.h) but lies |N(0, sigma_slide^2)| pixels inside of
//          it, on the same line in space; both are brought closer to the ends where less than shortest_px would remain
//   wrong match: the reports of a frame are paired at random and the two of a pair exchange their tracks by chance;
//          where their number is odd one keeps its own
// Each has a stream of its own, indexed by frame and segment. The noise is normal: the tails, correlations and outliers
// of scenario.camera are those of points.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/measurements.h"
#include "core/random.h"
#include "sim/line_tracker.h"
#include "sim/scenario.h"

namespace plumbline::sim {

struct LineReport {
  core::LineObservation observation;
  int track_segment = 0;  // what the tracker follows under this observation's track
  int segment = 0;        // what the observation is of; another where the match is wrong
  std::array<PieceEnd, 2> ends;
};

class LineSensor {
 public:
  // Refers to world and config as long as it lives.
  LineSensor(const World& world, const ScenarioConfig& config, core::TrialId id);

  // The next frame. Velocities are filled in where lines.velocity_source is `exact`: of the segment's point that the
  // end shows.
  std::vector<LineReport> observe(const FrameView& view, std::uint64_t frame_index);

 private:
  LineReport report(const LineSighting& sighting, const FrameView& view, std::uint64_t frame_index) const;
  std::array<PieceEnd, 2> slid_ends(const LineSighting& sighting, const FrameView& view,
                                    std::uint64_t frame_index) const;
  void match_wrongly(std::vector<LineReport>& reports, const std::vector<LineSighting>& sightings,
                     std::uint64_t frame_index) const;

  const World& world_;
  const LinesConfig& config_;
  LineTracker tracker_;
  core::RandomStream noise_;
  core::RandomStream slide_;
  core::RandomStream match_;
};

}  // namespace plumbline::sim
