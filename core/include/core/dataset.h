// A recording as a folder: what an estimator may see. docs/dataset.md describes the files.
//   meta.yaml                 schema, conventions, where it comes from
//   prior.yaml                what is known beforehand (mean, sigmas, start)
//   mav0/imu0/{data.csv, sensor.yaml}
//   mav0/cam0/{data.csv, points.csv, sensor.yaml}     points: frame_ns, track_id, u, v, and vx, vy where known
//   mav0/cam0/lines.csv       frame_ns, track_id, u0, v0, u1, v1, and vx0, vy0, vx1, vy1 where known; where lines are
// Numbers are written in their shortest form that reads back to the bit, stamps as integer nanoseconds.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include <nlohmann/json_fwd.hpp>

#include "core/config.h"
#include "core/measurements.h"

namespace plumbline::core {

struct DatasetMeta {
  std::string config_hash;
  std::uint64_t seed = 0;
  std::uint64_t trial = 0;
};

// Refuses, with a DataError, a folder that exists and is not empty. Throws std::system_error where it cannot write.
void write_dataset(const std::filesystem::path& folder, const MeasurementLog& log, const DatasetMeta& meta);

// Throws DataError or ConfigError, `file:line: rule`.
MeasurementLog read_dataset(const std::filesystem::path& folder);

// A pose and a calibration as sections of the YAML files of a dataset.
void visit(ConfigVisitor& v, Pose& c);
void visit(ConfigVisitor& v, RigCalibration& c);

// Block style, one key a line, lists in brackets.
std::string to_yaml(const nlohmann::ordered_json& value);

}  // namespace plumbline::core
