// The keys of scenario.lines: the segments that a frame tracks, and what is wrong with them.
#pragma once

#include <optional>

#include "core/config.h"
#include "core/error.h"
#include "sim/camera_config.h"

namespace plumbline::sim {

struct LinesConfig {
  int per_frame = 0;
  double nearest_m = 0.5;
  double farthest_m = 15.0;
  double sigma_px = 1.0;
  double shortest_px = 30.0;
  double loss_probability = 0.0;
  int longest_track_frames = 0;
  double slide_sigma_px = 0.0;
  double fragment_probability = 0.0;
  double merge_probability = 0.0;
  double wrong_match_probability = 0.0;
  VelocitySource velocity_source = VelocitySource::kFiniteDifference;
};

void visit(core::ConfigVisitor& v, LinesConfig& c);
std::optional<core::RuleViolation> validate(const LinesConfig& c);

}  // namespace plumbline::sim
