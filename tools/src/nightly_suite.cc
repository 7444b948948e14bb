#include "nightly_suite.h"

#include <algorithm>
#include <set>

#include <fmt/format.h>

#include "core/error.h"
#include "eval/metrics.h"
#include "tools/experiment.h"

namespace plumbline::tools {
namespace {

using core::ConfigTree;

const ConfigTree& required_list(const ConfigTree& root, const char* key) {
  const ConfigTree* list = core::find_value(root, key);
  if (list == nullptr || list->kind != ConfigTree::Kind::kSequence || list->items.empty()) {
    throw core::config_error(list != nullptr ? list->origin : root.origin, key, "must be a list of at least one");
  }
  return *list;
}

void require_known_keys(const ConfigTree& root) {
  for (const core::ConfigEntry& entry : root.entries) {
    if (entry.key != "nightly" && entry.key != "metrics" && entry.key != "experiments") {
      throw core::config_error(entry.origin, entry.key, "unknown key; a suite has nightly, metrics and experiments");
    }
  }
}

}  // namespace

void visit(core::ConfigVisitor& v, NightlyConfig& c) {
  v.value("trials", c.trials, core::between(6, 100'000), "of each cell, the same seeds every night");
  v.value("fresh_trials", c.fresh_trials, core::between(0, 100'000), "with seeds of this night alone");
  v.value("quick_trials", c.quick_trials, core::between(1, 100'000), "in place of `trials`, with --quick");
  v.value("seed", c.seed, core::any(), "of the trials that are the same every night");
  v.value("alpha", c.alpha, core::between(1e-9, 0.5), "probability that a night without a change is red");
  v.value("practical_minimum", c.practical_minimum, core::non_negative(),
          "a metric that grew by less is no reason for red");
  v.value("runtime_ratio", c.runtime_ratio, core::at_least(1.0), "an estimator slower than this is said, not red");
}

NightlySuite load_suite(const std::filesystem::path& file) {
  const ConfigTree root = core::load_config_file(file);
  if (root.kind != ConfigTree::Kind::kMap) throw core::config_error(root.origin, "", "must be a map of keys");
  require_known_keys(root);
  NightlySuite suite;
  if (const ConfigTree* rules = core::find_value(root, "nightly")) core::read_config(*rules, "nightly", suite.rules);
  for (const ConfigTree& item : required_list(root, "metrics").items) {
    const bool known = std::ranges::any_of(
        eval::kMetrics, [&](const eval::MetricInfo& info) { return info.name == item.scalar && info.in_table; });
    if (!known) throw core::config_error(item.origin, "metrics", fmt::format("no metric '{}'", item.scalar));
    suite.metrics.push_back(item.scalar);
  }
  std::set<std::string> names;
  for (const ConfigTree& item : required_list(root, "experiments").items) {
    const std::filesystem::path experiment = file.parent_path() / item.scalar;
    if (item.kind != ConfigTree::Kind::kScalar || !std::filesystem::is_regular_file(experiment)) {
      throw core::config_error(item.origin, "experiments",
                               fmt::format("no such file: {}", experiment.generic_string()));
    }
    if (!names.insert(load_plan(experiment, {}).base.experiment.name).second) {
      throw core::config_error(item.origin, "experiments", "the name is there twice");
    }
    suite.experiments.push_back(experiment);
  }
  return suite;
}

}  // namespace plumbline::tools
