// Pictures of a simulation, for the eye:
//   trajectory.png  the path from above, coloured by time, with landmarks, walls and doors; axes in metres
//   frame.png       the last points of the middle frame, each with its track's tail
#pragma once

#include <filesystem>
#include <string>

#include "sim/simulate.h"
#include "sim/trajectory.h"
#include "sim/world.h"

namespace plumbline::tools {

struct PlotInput {
  const sim::ScenarioConfig& scenario;
  const sim::Trajectory& trajectory;
  const sim::World& world;
  const sim::Simulation& simulation;
  std::string title;
};

// Into a folder that it makes. Throws std::runtime_error where a file cannot be written.
void write_plots(const std::filesystem::path& folder, const PlotInput& input);

}  // namespace plumbline::tools
