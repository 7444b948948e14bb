#include "sim/world_config.h"

#include "core/physical_ranges.h"

namespace plumbline::sim {

using core::between;
using core::kMostM;
using core::positive_up_to;

// Argument-dependent lookup finds these; it does not look into an unnamed namespace.
static void visit(core::ConfigVisitor& v, WallsConfig& c) {
  v.value("occlusion", c.occlusion, "whether they hide what is behind them; planes too");
  v.value("clearance_m", c.clearance_m, positive_up_to(kMostM),
          "least distance that they keep from the path of body and camera");
  v.value("floor_below_m", c.floor_below_m, positive_up_to(kMostM), "the floor, below the lowest point of the path");
  v.value("ceiling_above_m", c.ceiling_above_m, positive_up_to(kMostM), "the ceiling, above the highest point");
}

static void visit(core::ConfigVisitor& v, RoomsConfig& c) {
  v.value("longest_side_m", c.longest_side_m, between(1.0, kMostM), "a longer house is divided");
  v.value("margin_m", c.margin_m, core::up_to(kMostM), "from the path to the outer walls");
  v.value("door_width_m", c.door_width_m, positive_up_to(kMostM),
          "doors are where the path passes; wider where it needs more");
  v.value("door_height_m", c.door_height_m, positive_up_to(kMostM), "likewise");
}

static void visit(core::ConfigVisitor& v, CorridorConfig& c) {
  v.value("width_m", c.width_m, between(0.1, kMostM), "side of the square cells that it is made of, along the path");
}

static void visit(core::ConfigVisitor& v, PlanesConfig& c) {
  v.value("count", c.count, between(1, 10000), "how many squares");
  v.value("side_m", c.side_m, positive_up_to(kMostM), "of each");
}

void visit(core::ConfigVisitor& v, WorldConfig& c) {
  v.choice(
      "type", c.type, kWorldTypeNames,
      "`shell`: about the path, in all directions; `frustum`: in the pictures of the camera along the path; "
      "`planes`: on squares about the path; `rooms`: on walls, floor and ceiling of a house; `corridor`: likewise, "
      "of a corridor along the path");
  v.value("landmarks", c.landmarks, between(1, 1000000), "how many");
  v.value("nearest_m", c.nearest_m, positive_up_to(kMostM),
          "`shell` and `planes`: shortest distance from the place on the path that they surround; `frustum`: smallest "
          "depth");
  v.value("farthest_m", c.farthest_m, positive_up_to(kMostM), "longest distance from it; largest depth");
  v.section("walls", c.walls, "of `rooms` and `corridor`");
  v.section("rooms", c.rooms,
            "`rooms`: a house about the path, divided into equal rooms with a door between neighbours");
  v.section("corridor", c.corridor, "`corridor`");
  v.section("planes", c.planes, "`planes`: squares that face the path, more or less");
}

std::optional<core::RuleViolation> validate(const WorldConfig& c) {
  if (c.farthest_m < c.nearest_m) return core::RuleViolation{"farthest_m", "must be >= nearest_m"};
  if (c.type == WorldType::kCorridor && c.corridor.width_m < 2.0 * c.walls.clearance_m) {
    return core::RuleViolation{"corridor.width_m", "must be >= twice walls.clearance_m"};
  }
  return std::nullopt;
}

}  // namespace plumbline::sim
