#include "sim/world_config.h"

namespace plumbline::sim {

using core::positive;

void visit(core::ConfigVisitor& v, WorldConfig& c) {
  v.choice("type", c.type, kWorldTypeNames, "`shell`: about the path, in all directions");
  v.value("landmarks", c.landmarks, core::between(1, 1000000), "how many");
  v.value("nearest_m", c.nearest_m, positive(), "shortest distance from the place on the path that they surround");
  v.value("farthest_m", c.farthest_m, positive(), "longest distance from it");
}

std::optional<core::RuleViolation> validate(const WorldConfig& c) {
  if (c.farthest_m < c.nearest_m) return core::RuleViolation{"farthest_m", "must be >= nearest_m"};
  return std::nullopt;
}

}  // namespace plumbline::sim
