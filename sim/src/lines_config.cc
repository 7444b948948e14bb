#include "sim/lines_config.h"

#include "core/physical_ranges.h"

namespace plumbline::sim {

using core::positive_up_to;
using core::probability;
using core::up_to;

void visit(core::ConfigVisitor& v, LinesConfig& c) {
  v.value("per_frame", c.per_frame, core::between(0, 100000), "most segments that a frame tracks; 0 is no lines");
  v.value("nearest_m", c.nearest_m, positive_up_to(core::kMostPathM), "smallest depth of what is seen of a segment");
  v.value("farthest_m", c.farthest_m, positive_up_to(core::kMostPathM), "largest depth of it");
  v.value("sigma_px", c.sigma_px, up_to(core::kMostPixels), "noise of u and v of each end");
  v.value("shortest_px", c.shortest_px, up_to(core::kMostPixels), "what is seen of a segment must be as long");
  v.value("loss_probability", c.loss_probability, probability(), "that a track ends at a frame");
  v.value("longest_track_frames", c.longest_track_frames, core::at_least(0),
          "a track ends after as many; 0 is no limit");
  v.value("slide_sigma_px", c.slide_sigma_px, up_to(core::kMostPixels),
          "how far each reported end lies inside of what is seen, the absolute value of a normal number");
  v.value("fragment_probability", c.fragment_probability, probability(),
          "that a segment breaks at a frame into two parts, which are tracks of their own from then on");
  v.value("merge_probability", c.merge_probability, probability(),
          "that the two parts are one track again at a frame, the older one");
  v.value("wrong_match_probability", c.wrong_match_probability, probability(),
          "that an observation carries the track of another segment: two of a frame are swapped");
  v.choice("velocity_source", c.velocity_source, kVelocitySourceNames,
           "of the image velocities of the ends: a tracker's, across the line, from the noisy pixels of consecutive "
           "frames; the truth; or absent");
}

std::optional<core::RuleViolation> validate(const LinesConfig& c) {
  if (c.farthest_m < c.nearest_m) return core::RuleViolation{"farthest_m", "must be >= nearest_m"};
  return std::nullopt;
}

}  // namespace plumbline::sim
