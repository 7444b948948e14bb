// The keys of scenario.world: the landmarks that there are.
#pragma once

#include <array>
#include <optional>
#include <string_view>

#include "core/config.h"
#include "core/error.h"

namespace plumbline::sim {

enum class WorldType { kShell };
inline constexpr std::array<std::string_view, 1> kWorldTypeNames = {"shell"};

struct WorldConfig {
  WorldType type = WorldType::kShell;
  int landmarks = 4000;
  double nearest_m = 3.0;
  double farthest_m = 8.0;
};

void visit(core::ConfigVisitor& v, WorldConfig& c);
std::optional<core::RuleViolation> validate(const WorldConfig& c);

}  // namespace plumbline::sim
