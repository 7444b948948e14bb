// The keys of scenario.world: the landmarks and segments that there are, and the walls.
#pragma once

#include <array>
#include <optional>
#include <string_view>

#include "core/config.h"
#include "core/error.h"

namespace plumbline::sim {

enum class WorldType { kShell, kFrustum, kPlanes, kRooms, kCorridor };
inline constexpr std::array<std::string_view, 5> kWorldTypeNames = {"shell", "frustum", "planes", "rooms", "corridor"};

// Of rooms and corridors.
struct WallsConfig {
  bool occlusion = true;  // of planes too
  double clearance_m = 0.4;
  double floor_below_m = 1.4;
  double ceiling_above_m = 1.0;
};

struct RoomsConfig {
  double longest_side_m = 6.0;
  double margin_m = 1.0;
  double door_width_m = 0.9;
  double door_height_m = 2.0;
};

struct CorridorConfig {
  double width_m = 2.0;
};

struct PlanesConfig {
  int count = 30;
  double side_m = 3.0;
};

// A row of them along every upright wall.
struct WindowsConfig {
  double spacing_m = 0.0;  // 0 is no windows
  double width_m = 1.0;
  double height_m = 1.0;
  double sill_m = 1.0;  // above the floor
};

struct WorldLinesConfig {
  bool edges = true;
  bool doors = true;
  WindowsConfig windows;
  double grid_spacing_m = 0.0;  // 0 is no grid
  int random = 0;
  double random_shortest_m = 0.5;
  double random_longest_m = 2.0;
};

struct WorldConfig {
  WorldType type = WorldType::kShell;
  int landmarks = 4000;
  double nearest_m = 3.0;
  double farthest_m = 8.0;
  WallsConfig walls;
  RoomsConfig rooms;
  CorridorConfig corridor;
  PlanesConfig planes;
  WorldLinesConfig lines;

  // Whether it may hold any segment.
  bool has_lines() const;
};

void visit(core::ConfigVisitor& v, WorldConfig& c);
std::optional<core::RuleViolation> validate(const WorldConfig& c);

}  // namespace plumbline::sim
