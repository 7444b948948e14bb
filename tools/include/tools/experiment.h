// An experiment: a scenario, an estimator and metrics, the axes along which keys of them vary, trials and a seed.
//
//   experiment: {trials: 50, seed: 1, axes: {scenario.camera.td_s: [0, 0.02]}}
//   scenario: ../scenarios/handheld_rs.yaml        (or the keys themselves)
//   estimator: ../estimators/batch.yaml            (likewise)
//   eval: {alignment: posyaw}
//   set: {scenario.camera.readout_s: 0.01}         (on top of the files)
//
// The cells are the product of the axes, the last one varying fastest; tools/src/axes.h has ranges, axes that step
// together, and filters. An override (--set) of an axis' key replaces the axis. What a cell is does not depend on how
// its values were written down: the same configuration has the same run_ids.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "core/config.h"
#include "estimator/config.h"
#include "eval/evaluate.h"
#include "sim/scenario.h"

namespace plumbline::eval {
// Found by argument-dependent lookup.
void visit(core::ConfigVisitor& v, MetricsConfig& c);
}  // namespace plumbline::eval

namespace plumbline::tools {

struct ExperimentConfig {
  std::string name;  // the file's name where absent
  int trials = 1;
  std::uint64_t seed = 1;
  double max_failed_share = 0.0;
  double cpu_limit_s = 3600.0;
};
void visit(core::ConfigVisitor& v, ExperimentConfig& c);

// Everything that a trial depends on but its number.
struct Experiment {
  ExperimentConfig experiment;
  sim::ScenarioConfig scenario;
  estimator::EstimatorConfig estimator;
  eval::MetricsConfig metrics;
};
void visit(core::ConfigVisitor& v, Experiment& c);

struct Cell {
  nlohmann::ordered_json axes;  // {"full.key": value}
  Experiment experiment;
  std::string config_hash;  // of scenario, estimator, eval and seed; files count by their content
};

struct Plan {
  Experiment base;  // without the axes
  std::vector<Cell> cells;
  std::string config_hash;  // of all cells

  int runs() const { return static_cast<int>(cells.size()) * base.experiment.trials; }
};

// 16 hexadecimal digits that name a trial of a cell anywhere.
std::string run_id(const Cell& cell, int trial);

// `overrides` are those of --set; where there are some of --only, the plan has only their cells. Throws
// core::ConfigError or core::DataError, in one line; every cell is checked, with the pose files they name.
Plan load_plan(const std::filesystem::path& file, const std::vector<std::string>& overrides,
               const std::vector<std::string>& only = {});

// A scenario or an estimator alone. Keys of overrides start with "scenario." or "estimator.".
sim::ScenarioConfig load_scenario(const std::filesystem::path& file, const std::vector<std::string>& overrides);
estimator::EstimatorConfig load_estimator(const std::optional<std::filesystem::path>& file,
                                          const std::vector<std::string>& overrides);  // the defaults without a file

// manifest.json: the plan, self-contained, and back.
nlohmann::ordered_json to_manifest(const Plan& plan);
Plan read_manifest(const std::filesystem::path& file);

// What an experiment, scenario or estimator file is, told by its keys. A scenario and an estimator share some keys: a
// file that holds no others may be either.
enum class ConfigKind { kExperiment, kScenario, kEstimator };
std::vector<ConfigKind> config_kinds(const std::filesystem::path& file);

}  // namespace plumbline::tools
