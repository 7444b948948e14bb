// What a simulation is made of. Each field is a key of the YAML file, in the units of its name; configs/README.md
// documents them all.
#pragma once

#include <optional>

#include "core/calibration.h"
#include "core/config.h"
#include "core/error.h"
#include "sim/camera_config.h"
#include "sim/imu_config.h"
#include "sim/lines_config.h"
#include "sim/prior_config.h"
#include "sim/trajectory_config.h"
#include "sim/world_config.h"

namespace plumbline::sim {

struct ScenarioConfig {
  double duration_s = 15.0;
  double gravity_m_s2 = 9.81;
  TrajectoryConfig trajectory;
  ImuConfig imu;
  CameraConfig camera;
  WorldConfig world;
  PointsConfig points;
  LinesConfig lines;
  PriorConfig prior;

  // The rig as it truly is, td of the middle row.
  core::RigCalibration calibration() const;
};

void visit(core::ConfigVisitor& v, ScenarioConfig& c);

// Rules that join several keys or elements; the key is relative to the scenario.
std::optional<core::RuleViolation> validate(const ScenarioConfig& c);

}  // namespace plumbline::sim
