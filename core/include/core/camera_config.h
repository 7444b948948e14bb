// The keys of a camera model, the same in a scenario and in the sensor.yaml of a dataset.
#pragma once

#include <optional>

#include "core/camera.h"
#include "core/config.h"
#include "core/error.h"

namespace plumbline::core {

void visit(ConfigVisitor& v, PinholeCamera& c);
std::optional<RuleViolation> validate(const PinholeCamera& c);

}  // namespace plumbline::core
