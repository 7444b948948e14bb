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

static void visit(core::ConfigVisitor& v, WindowsConfig& c) {
  v.value("spacing_m", c.spacing_m, core::up_to(kMostM), "from centre to centre; 0 is no windows");
  v.value("width_m", c.width_m, positive_up_to(kMostM), "of each");
  v.value("height_m", c.height_m, positive_up_to(kMostM), "of each");
  v.value("sill_m", c.sill_m, core::up_to(kMostM),
          "above the floor; a window that does not fit or meets a door is left out");
}

static void visit(core::ConfigVisitor& v, WorldLinesConfig& c) {
  v.value("edges", c.edges, "where walls meet one another, the floor and the ceiling; of `planes` the outlines");
  v.value("doors", c.doors, "the frames of the doors of `rooms`");
  v.section("windows", c.windows, "rectangles on the walls of `rooms` and `corridor`");
  v.value("grid_spacing_m", c.grid_spacing_m, core::up_to(kMostM),
          "of lines along both directions of every wall, floor, ceiling and plane; 0 is no grid");
  v.value(
      "random", c.random, between(0, 1000000),
      "how many more, placed and turned at random, where the landmarks of the world are: in space, or on the faces");
  v.value("random_shortest_m", c.random_shortest_m, positive_up_to(kMostM), "length of these");
  v.value("random_longest_m", c.random_longest_m, positive_up_to(kMostM), "likewise");
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
  v.section("lines", c.lines, "the segments that there are, where scenario.lines tracks any");
}

bool WorldConfig::has_lines() const {
  const bool in_space = type == WorldType::kShell || type == WorldType::kFrustum;
  const bool upright = type == WorldType::kRooms || type == WorldType::kCorridor;
  return lines.random > 0 || (!in_space && (lines.edges || lines.grid_spacing_m > 0.0)) ||
         (type == WorldType::kRooms && lines.doors) || (upright && lines.windows.spacing_m > 0.0);
}

std::optional<core::RuleViolation> validate(const WorldConfig& c) {
  if (c.farthest_m < c.nearest_m) return core::RuleViolation{"farthest_m", "must be >= nearest_m"};
  if (c.type == WorldType::kCorridor && c.corridor.width_m < 2.0 * c.walls.clearance_m) {
    return core::RuleViolation{"corridor.width_m", "must be >= twice walls.clearance_m"};
  }
  if (c.lines.random_longest_m < c.lines.random_shortest_m) {
    return core::RuleViolation{"lines.random_longest_m", "must be >= random_shortest_m"};
  }
  return std::nullopt;
}

}  // namespace plumbline::sim
