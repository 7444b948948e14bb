#include "tools/experiment.h"

#include <algorithm>
#include <array>
#include <limits>
#include <set>
#include <utility>

#include <fmt/format.h>

#include "axes.h"
#include "core/error.h"
#include "core/hash.h"
#include "core/physical_ranges.h"
#include "core/resolved_config.h"
#include "estimator/estimate.h"
#include "sim/imu_sensor.h"
#include "sim/trajectory.h"
#include "sim/world.h"
#include "tools/external_estimator.h"

namespace plumbline::eval {

void visit(core::ConfigVisitor& v, MetricsConfig& c) {
  v.choice("alignment", c.alignment, kAlignmentNames, "of the trajectory, for the ATE");
  v.value("first_n", c.first_n, core::at_least(0), "poses that decide the alignment; 0: all");
  v.value("first_s", c.first_s, core::non_negative(), "or those of the first seconds; 0: all");
  v.value("crlb", c.crlb,
          "the Cramer-Rao bound of each trial beside its errors; with the scenario's noise and all poses");
  v.value("td_bound_s", c.td_bound_s, core::positive(), "td has converged once its error stays within this for good");
}

}  // namespace plumbline::eval

namespace plumbline::tools {

void visit(core::ConfigVisitor& v, ExperimentConfig& c) {
  v.value("name", c.name, "of the results' folder; the file's name where empty");
  v.value("trials", c.trials, core::between(1, 10'000'000), "of each cell");
  v.value("seed", c.seed, core::any(), "of all draws");
  v.value("max_failed_share", c.max_failed_share, core::probability(), "more failed trials than this: exit code 1");
  v.value("cpu_limit_s", c.cpu_limit_s, core::non_negative(),
          "processor time of a trial, after which its worker process is ended; 0: none");
}

void visit(core::ConfigVisitor& v, Experiment& c) {
  v.section("experiment", c.experiment, "trials and seed; also `axes`, `zip`, `skip` and `only`: configs/README.md");
  v.section("scenario", c.scenario, "what is simulated");
  v.section("estimator", c.estimator, "how it is estimated");
  v.section("eval", c.metrics, "how it is scored");
}

namespace {

using core::ConfigEntry;
using core::ConfigTree;
using nlohmann::ordered_json;

ConfigTree* find_entry(ConfigTree& map, std::string_view key) {
  const auto entry = std::find_if(map.entries.begin(), map.entries.end(), [&](const auto& e) { return e.key == key; });
  return entry == map.entries.end() ? nullptr : &entry->value;
}

void require_map(const ConfigTree& tree, std::string_view key) {
  if (tree.kind != ConfigTree::Kind::kMap && tree.kind != ConfigTree::Kind::kNull) {
    throw core::config_error(tree.origin, key, "must be a map of keys");
  }
}

// Takes the entry out of the map; null where it has none.
ConfigTree take_entry(ConfigTree& map, std::string_view key) {
  ConfigTree* found = find_entry(map, key);
  if (found == nullptr) return {};
  ConfigTree taken = std::move(*found);
  std::erase_if(map.entries, [&](const ConfigEntry& e) { return e.key == key; });
  return taken;
}

// `scenario: FILE` becomes what is in the file.
void include_files(ConfigTree& root) {
  for (const std::string_view key : {"scenario", "estimator"}) {
    ConfigTree* section = find_entry(root, key);
    if (section == nullptr || section->kind != ConfigTree::Kind::kScalar) continue;
    std::filesystem::path file = section->scalar;
    const bool from_command_line = section->origin.line == 0;
    if (!from_command_line) file = std::filesystem::path(*section->origin.label).parent_path() / file;
    if (!std::filesystem::is_regular_file(file)) {
      throw core::config_error(section->origin, key, fmt::format("no such file: {}", file.generic_string()));
    }
    *section = core::load_config_file(file);
    require_map(*section, key);
  }
}

// Takes what read_sweep() reads.
Sweep take_sweep(ConfigTree& root) {
  ConfigTree* experiment = find_entry(root, "experiment");
  if (experiment == nullptr || experiment->kind != ConfigTree::Kind::kMap) return {};
  Sweep sweep = read_sweep(*experiment);
  std::erase_if(experiment->entries,
                [](const ConfigEntry& e) { return std::ranges::find(kSweepKeys, e.key) != kSweepKeys.end(); });
  // The reader of the other keys does not know these.
  const std::vector<core::KeyDoc> others = core::document_config(ExperimentConfig{}, "");
  for (const ConfigEntry& e : experiment->entries) {
    const std::string nearest = core::nearest(e.key, kSweepKeys);
    if (!nearest.empty() && std::ranges::find(others, e.key, &core::KeyDoc::key) == others.end()) {
      throw core::config_error(e.origin, "experiment." + e.key,
                               fmt::format("unknown key; did you mean '{}'?", nearest));
    }
  }
  return sweep;
}

// Names the place of the key, or of the innermost section that would hold it.
core::ConfigError located(const ConfigTree& root, const core::RuleViolation& violation) {
  for (std::string_view key = violation.key;;) {
    if (const ConfigTree* value = core::find_value(root, key)) {
      return core::config_error(value->origin, violation.key, violation.rule);
    }
    const std::size_t dot = key.rfind('.');
    if (dot == std::string_view::npos) return core::config_error(root.origin, violation.key, violation.rule);
    key = key.substr(0, dot);
  }
}

// Of the root of an experiment; unknown keys of it and below are errors.
Experiment read_experiment(const ConfigTree& root) {
  Experiment experiment;
  core::read_config(root, "", experiment);
  std::optional<core::RuleViolation> violation = sim::validate(experiment.scenario);
  if (violation) {
    violation->key = "scenario." + violation->key;
  } else if (experiment.metrics.first_n != 0 && experiment.metrics.first_s != 0.0) {
    violation = core::RuleViolation{"eval.first_s", "give eval.first_n or this, not both"};
  }
  if (violation) throw located(root, *violation);
  return experiment;
}

std::string hash_of(const Experiment& experiment) {
  const ordered_json content = {
      {"seed", experiment.experiment.seed},
      {"scenario", core::resolved_config(experiment.scenario, core::PathForm::kContentHash)},
      {"estimator", core::resolved_config(experiment.estimator, core::PathForm::kContentHash)},
      {"eval", core::resolved_config(experiment.metrics, core::PathForm::kContentHash)}};
  return core::content_hash(content.dump());
}

// What only shows when a scenario's parts meet: pose files that are too short, worlds without room for the path, motion
// that no IMU could follow.
void check_scenario(const sim::ScenarioConfig& scenario, core::TrialId id) {
  const auto trajectory = sim::make_trajectory(scenario.trajectory, scenario.duration_s, id);
  sim::make_world(scenario, *trajectory, id);
  sim::simulate_imu(*trajectory, scenario.imu, scenario.gravity_m_s2, scenario.duration_s, id);
}

// Likewise a cell's: noise the estimator cannot work with.
void check_cell(const Experiment& e) {
  const double pixel_sigma_px = e.scenario.camera.pixel_sigma_px;
  const double line_sigma_px = e.scenario.lines.sigma_px;
  const bool has_lines = e.scenario.lines.per_frame > 0;
  if (e.estimator.type == estimator::EstimatorType::kExternal) {
    require_runnable(e.estimator.external);
  } else {
    estimator::require_usable(
        e.estimator, estimator::believed_noise(e.estimator, e.scenario.imu.noise, pixel_sigma_px, line_sigma_px),
        e.scenario.prior.calibration_sigmas(), has_lines);
  }
  if (e.metrics.crlb) {
    if (estimator::starts_from_scratch(e.estimator)) {
      throw core::RuleError({"eval.crlb", "is of what the prior says of the first state, too; not from scratch"});
    }
    if (e.metrics.first_n > 0 || e.metrics.first_s > 0.0) {
      throw core::RuleError({"eval.crlb", "is of an alignment by all poses; leave out first_n and first_s"});
    }
    // The bound speaks of the true noise, whatever the estimator believes.
    const core::ImuNoise& imu = e.scenario.imu.noise;
    double least = std::min({imu.gyro_noise_density, imu.gyro_bias_walk, imu.accel_noise_density, imu.accel_bias_walk});
    if (estimator::uses_points(e.estimator.use)) least = std::min(least, pixel_sigma_px);
    if (estimator::uses_lines(e.estimator.use) && has_lines) least = std::min(least, line_sigma_px);
    if (!(least >= core::kLeastSigma)) {
      throw core::RuleError(
          {"eval.crlb", fmt::format("needs noise: scenario.camera.pixel_sigma_px, scenario.lines.sigma_px where there "
                                    "are lines, and the four noises of scenario.imu must be >= {}",
                                    core::kLeastSigma)});
    }
  }
  check_scenario(e.scenario, {e.experiment.seed, 0});
}

// Such a check, whose findings are located.
template <class Check>
void check_meeting(const ConfigTree& root, Check check) {
  try {
    check();
  } catch (const core::RuleError& error) {
    throw located(root, error.violation);
  }
}

Cell make_cell(ConfigTree root, const Sweep& sweep, const std::vector<const ConfigTree*>& values) {
  ordered_json axes = ordered_json::object();
  for (std::size_t i = 0; i < values.size(); ++i) {
    core::set_value(root, sweep.axes[i].key, *values[i]);
    if (!sweep.axes[i].replaced) axes[sweep.axes[i].key] = plain_value(*values[i]);
  }
  Cell cell{.axes = axes, .experiment = read_experiment(root), .config_hash = {}};
  cell.config_hash = hash_of(cell.experiment);
  check_meeting(root, [&] { check_cell(cell.experiment); });
  return cell;
}

Plan make_plan(const ConfigTree& root, const Sweep& sweep, const std::string& default_name) {
  Plan plan;
  plan.base = read_experiment(root);
  std::string& name = plan.base.experiment.name;
  if (name.empty()) name = default_name;
  if (name.find('/') != std::string::npos || name == "." || name == "..") {
    throw located(root, {"experiment.name", fmt::format("must be a plain name, got '{}'", name)});
  }
  const auto cells = cells_of(sweep);
  const int most_trials = std::numeric_limits<int>::max() / static_cast<int>(cells.size());
  if (plan.base.experiment.trials > most_trials) {
    throw located(root, {"experiment.trials", fmt::format("must be <= {} for {} cells", most_trials, cells.size())});
  }
  std::set<std::string> hashes;
  std::string all_hashes;
  for (const auto& values : cells) {
    Cell cell = make_cell(root, sweep, values);
    // A run's id would name two runs.
    if (!hashes.insert(cell.config_hash).second) {
      throw core::config_error(sweep.origin, "experiment.axes",
                               fmt::format("the cell {} is there twice", cell.axes.dump()));
    }
    all_hashes += cell.config_hash;
    plan.cells.push_back(std::move(cell));
  }
  plan.config_hash = core::content_hash(all_hashes);
  return plan;
}

// What must be there before files are read and axes taken.
bool comes_first(std::string_view key) {
  if (key == "scenario" || key == "estimator") return true;
  return std::ranges::any_of(kSweepKeys, [&](std::string_view k) { return key == fmt::format("experiment.{}", k); });
}

ConfigTree apply_overrides(ConfigTree root, const std::vector<std::string>& overrides, Sweep* sweep) {
  std::vector<core::ConfigOverride> parsed;
  parsed.reserve(overrides.size());
  for (const std::string& text : overrides) parsed.push_back(core::parse_override(text));
  // Files first, so that keys can be set on top of them wherever the file's name was given.
  for (core::ConfigOverride& o : parsed) {
    if (comes_first(o.key)) core::set_value(root, o.key, o.value);
  }
  include_files(root);
  if (sweep != nullptr) *sweep = take_sweep(root);
  const ConfigTree settings = take_entry(root, "set");
  require_map(settings, "set");
  for (const ConfigEntry& entry : settings.entries) core::set_value(root, entry.key, entry.value);
  for (const core::ConfigOverride& o : parsed) {
    if (comes_first(o.key)) continue;
    core::set_value(root, o.key, o.value);
    if (sweep != nullptr) replace_axis(*sweep, o);
  }
  return root;
}

// A tree {KEY: what is in the file}.
ConfigTree wrap(const std::filesystem::path& file, const std::string& key) {
  ConfigTree root;
  root.kind = ConfigTree::Kind::kMap;
  ConfigTree content = core::load_config_file(file);
  require_map(content, key);
  root.origin = content.origin;
  root.entries.push_back({key, content.origin, std::move(content)});
  return root;
}

// How many keys of the tree, with all below them, are documented.
int known_keys(const ConfigTree& tree, const std::string& prefix, const std::vector<core::KeyDoc>& docs) {
  int count = 0;
  for (const ConfigEntry& entry : tree.entries) {
    const std::string key = prefix + entry.key;
    if (std::any_of(docs.begin(), docs.end(), [&](const core::KeyDoc& doc) { return doc.key == key; })) ++count;
    count += known_keys(entry.value, key + ".", docs);
  }
  return count;
}

}  // namespace

std::string run_id(const Cell& cell, int trial) {
  return core::content_hash(fmt::format("{}/{}", cell.config_hash, trial));
}

Plan load_plan(const std::filesystem::path& file, const std::vector<std::string>& overrides,
               const std::vector<std::string>& only) {
  ConfigTree root = core::load_config_file(file);
  require_map(root, "");
  Sweep sweep;
  root = apply_overrides(std::move(root), overrides, &sweep);
  keep_only(sweep, only);
  return make_plan(root, sweep, file.stem().string());
}

sim::ScenarioConfig load_scenario(const std::filesystem::path& file, const std::vector<std::string>& overrides) {
  const ConfigTree root = apply_overrides(wrap(file, "scenario"), overrides, nullptr);
  const Experiment experiment = read_experiment(root);
  check_meeting(root, [&] { check_scenario(experiment.scenario, {}); });
  return experiment.scenario;
}

estimator::EstimatorConfig load_estimator(const std::optional<std::filesystem::path>& file,
                                          const std::vector<std::string>& overrides) {
  ConfigTree root;
  root.kind = ConfigTree::Kind::kMap;
  if (file) root = wrap(*file, "estimator");
  return read_experiment(apply_overrides(std::move(root), overrides, nullptr)).estimator;
}

ordered_json to_manifest(const Plan& plan) {
  ordered_json cells = ordered_json::array();
  for (const Cell& cell : plan.cells) {
    ordered_json config = core::resolved_config(cell.experiment);
    config.erase("experiment");
    cells.push_back({{"axes", cell.axes}, {"config_hash", cell.config_hash}, {"config", config}});
  }
  return {{"schema", "plumbline-manifest/1"},
          {"experiment", core::resolved_config(plan.base.experiment)},
          {"config_hash", plan.config_hash},
          {"runs", plan.runs()},
          {"run_id", "XXH3-64 of 'CONFIG_HASH/TRIAL' of the cell"},
          {"cells", cells}};
}

Plan read_manifest(const std::filesystem::path& file) {
  // A manifest is JSON, which the strict reader takes as YAML.
  ConfigTree manifest = core::load_config_file(file);
  require_map(manifest, "");
  const ConfigTree schema = take_entry(manifest, "schema");
  if (schema.scalar != "plumbline-manifest/1") {
    throw core::config_error(manifest.origin, "schema", "must be plumbline-manifest/1");
  }
  const ConfigTree experiment = take_entry(manifest, "experiment");
  const ConfigTree cells = take_entry(manifest, "cells");
  if (cells.kind != ConfigTree::Kind::kSequence || cells.items.empty()) {
    throw core::config_error(manifest.origin, "cells", "must be a list of at least one cell");
  }
  Plan plan;
  for (ConfigTree item : cells.items) {
    require_map(item, "cells");
    ConfigTree root = take_entry(item, "config");
    require_map(root, "cells.config");
    root.entries.push_back({"experiment", experiment.origin, experiment});
    Cell cell{.axes = ordered_json::object(), .experiment = read_experiment(root), .config_hash = {}};
    const ConfigTree axes = take_entry(item, "axes");
    for (const ConfigEntry& axis : axes.entries) cell.axes[axis.key] = plain_value(axis.value);
    cell.config_hash = hash_of(cell.experiment);
    if (cell.config_hash != take_entry(item, "config_hash").scalar) {
      throw core::config_error(item.origin, "cells.config_hash",
                               "does not match the cell's configuration and the files it names");
    }
    plan.cells.push_back(std::move(cell));
  }
  plan.base = plan.cells.front().experiment;
  plan.config_hash = take_entry(manifest, "config_hash").scalar;
  return plan;
}

std::vector<ConfigKind> config_kinds(const std::filesystem::path& file) {
  const ConfigTree root = core::load_config_file(file);
  require_map(root, "");
  constexpr std::array<std::string_view, 5> kExperimentKeys = {"experiment", "scenario", "estimator", "eval", "set"};
  const bool is_experiment = std::any_of(root.entries.begin(), root.entries.end(), [&](const ConfigEntry& e) {
    return std::find(kExperimentKeys.begin(), kExperimentKeys.end(), e.key) != kExperimentKeys.end();
  });
  if (is_experiment) return {ConfigKind::kExperiment};
  const int of_scenario = known_keys(root, "", core::document_config(sim::ScenarioConfig{}, ""));
  const int of_estimator = known_keys(root, "", core::document_config(estimator::EstimatorConfig{}, ""));
  if (of_scenario == 0 && of_estimator == 0) {
    throw core::config_error(root.origin, "", "is neither an experiment nor a scenario nor an estimator");
  }
  std::vector<ConfigKind> kinds;
  if (of_scenario >= of_estimator) kinds.push_back(ConfigKind::kScenario);
  if (of_estimator >= of_scenario) kinds.push_back(ConfigKind::kEstimator);
  return kinds;
}

}  // namespace plumbline::tools
