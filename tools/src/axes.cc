#include "axes.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "core/config.h"
#include "core/error.h"

namespace plumbline::tools {
namespace {

using core::ConfigEntry;
using core::ConfigTree;
using nlohmann::ordered_json;

struct RangeConfig {
  std::vector<double> linspace;
  std::vector<double> logspace;
};
void visit(core::ConfigVisitor& v, RangeConfig& c) {
  v.value("linspace", c.linspace, core::any(), "[a, b, n]");
  v.value("logspace", c.logspace, core::positive(), "[a, b, n]");
}

// Number i of 0 .. last; twelve digits of a power, so that other mathematical libraries give the same, and
// powers of ten come out as such.
std::string range_value(double a, double b, int i, int last, bool logarithmic) {
  if (i == 0) return fmt::format("{}", a);
  if (i == last) return fmt::format("{}", b);
  if (logarithmic) return fmt::format("{:.12g}", a * std::pow(b / a, static_cast<double>(i) / last));
  return fmt::format("{}", a + (b - a) * i / last);
}

std::vector<ConfigTree> range_values(const ConfigTree& tree, const std::string& key) {
  RangeConfig range;
  core::read_config(tree, key, range);
  const bool logarithmic = !range.logspace.empty();
  const std::vector<double>& numbers = logarithmic ? range.logspace : range.linspace;
  if (numbers.size() != 3 || (logarithmic && !range.linspace.empty())) {
    throw core::config_error(tree.origin, key, "a range is {linspace: [a, b, n]} or {logspace: [a, b, n]}");
  }
  if (!(numbers[2] >= 2.0 && numbers[2] <= kMaxProduct && numbers[2] == std::floor(numbers[2]))) {
    throw core::config_error(tree.origin, key,
                             fmt::format("n must be a whole number from 2 to {}, got {}", kMaxProduct, numbers[2]));
  }
  const int last = static_cast<int>(numbers[2]) - 1;
  std::vector<ConfigTree> values;
  for (int i = 0; i <= last; ++i) {
    ConfigTree& value = values.emplace_back();
    value.kind = ConfigTree::Kind::kScalar;
    value.origin = tree.origin;
    value.scalar = range_value(numbers[0], numbers[1], i, last, logarithmic);
  }
  return values;
}

std::vector<Axis> read_axes(const ConfigTree& map) {
  if (map.kind != ConfigTree::Kind::kMap && map.kind != ConfigTree::Kind::kNull) {
    throw core::config_error(map.origin, "experiment.axes", "must be a map of keys");
  }
  std::vector<Axis> axes;
  for (const ConfigEntry& entry : map.entries) {
    const std::string key = "experiment.axes." + entry.key;
    if (!(entry.key.starts_with("scenario.") || entry.key.starts_with("estimator."))) {
      throw core::config_error(entry.origin, key, "an axis is a full key such as scenario.camera.td_s");
    }
    if (entry.value.kind == ConfigTree::Kind::kMap) {
      axes.push_back({entry.key, range_values(entry.value, key)});
    } else if (entry.value.kind == ConfigTree::Kind::kSequence && !entry.value.items.empty()) {
      axes.push_back({entry.key, entry.value.items});
    } else {
      throw core::config_error(entry.origin, key, "must be a list of at least one value, or a range");
    }
  }
  return axes;
}

// None where the list is absent.
const std::vector<ConfigTree>& items_of(const ConfigTree& list, std::string_view key, std::string_view rule) {
  if (list.kind != ConfigTree::Kind::kSequence && list.kind != ConfigTree::Kind::kNull) {
    throw core::config_error(list.origin, key, rule);
  }
  return list.items;
}

// Where `name` stands wrong at `place`.
std::size_t axis_index(const std::vector<Axis>& axes, const std::string& name, const core::Origin& origin,
                       std::string_view place) {
  std::vector<std::string_view> keys;
  for (const Axis& axis : axes) {
    if (axis.key == name) return keys.size();
    keys.emplace_back(axis.key);
  }
  const std::string nearest = core::nearest(name, keys);
  throw core::config_error(
      origin, place,
      fmt::format("'{}' is no axis{}", name, nearest.empty() ? "" : fmt::format("; did you mean '{}'?", nearest)));
}

std::vector<std::vector<std::size_t>> read_zipped(const ConfigTree& list, const std::vector<Axis>& axes) {
  constexpr std::string_view kPlace = "experiment.zip";
  constexpr std::string_view kRule = "must be a list of lists of two or more axes";
  std::vector<std::vector<std::size_t>> zipped;
  std::vector<bool> used(axes.size());
  for (const ConfigTree& item : items_of(list, kPlace, kRule)) {
    std::vector<std::size_t>& group = zipped.emplace_back();
    for (const ConfigTree& key : items_of(item, kPlace, kRule)) {
      const std::size_t i = axis_index(axes, key.scalar, key.origin, kPlace);
      if (used[i]) throw core::config_error(key.origin, kPlace, fmt::format("'{}' stands here twice", key.scalar));
      used[i] = true;
      group.push_back(i);
    }
    if (group.size() < 2) throw core::config_error(item.origin, kPlace, kRule);
    std::ranges::sort(group);
    const auto differs = [&](std::size_t i) { return axes[i].values.size() != axes[group.front()].values.size(); };
    const auto other = std::ranges::find_if(group, differs);
    if (other != group.end()) {
      const Axis& first = axes[group.front()];
      throw core::config_error(item.origin, kPlace,
                               fmt::format("{} has {} values, {} has {}", first.key, first.values.size(),
                                           axes[*other].key, axes[*other].values.size()));
    }
  }
  return zipped;
}

// Numbers that agree to nine digits are the same: 0.03 also means the 0.030000000000000006 of a range.
bool same_value(const ordered_json& a, const ordered_json& b) {
  if (a.is_number() && b.is_number()) {
    const double x = a.get<double>();
    const double y = b.get<double>();
    return std::abs(x - y) <= 1e-9 * std::max(std::abs(x), std::abs(y));
  }
  if (a.is_array() && b.is_array()) return std::equal(a.begin(), a.end(), b.begin(), b.end(), same_value);
  return a == b;
}

CellFilter::Condition read_condition(const std::vector<Axis>& axes, const std::string& key, const ConfigTree& value,
                                     const core::Origin& origin, const std::string& place) {
  CellFilter::Condition condition{.axis = axis_index(axes, key, origin, place), .values = {}};
  const Axis& axis = axes[condition.axis];
  std::vector<ordered_json> known;
  known.reserve(axis.values.size());
  for (const ConfigTree& v : axis.values) known.push_back(plain_value(v));
  const ordered_json wanted = plain_value(value);
  for (const ordered_json& v : wanted.is_array() ? wanted : ordered_json::array({wanted})) {
    const bool is_known = std::ranges::any_of(known, [&](const ordered_json& k) { return same_value(k, v); });
    if (!is_known && !axis.replaced) {
      const std::string all = ordered_json(known).dump();
      throw core::config_error(origin, place, fmt::format("{} is not among the axis' values, {}", v.dump(), all));
    }
    condition.values.push_back(v);
  }
  return condition;
}

std::vector<CellFilter> read_filters(const ConfigTree& list, const std::string& place, const std::vector<Axis>& axes) {
  constexpr std::string_view kRule = "must be a list of maps from axes to values";
  std::vector<CellFilter> filters;
  for (const ConfigTree& map : items_of(list, place, kRule)) {
    if (map.kind != ConfigTree::Kind::kMap || map.entries.empty()) throw core::config_error(map.origin, place, kRule);
    CellFilter& filter = filters.emplace_back();
    for (const ConfigEntry& e : map.entries) {
      filter.conditions.push_back(read_condition(axes, e.key, e.value, e.origin, place + "." + e.key));
    }
  }
  return filters;
}

bool holds_one(const std::vector<CellFilter>& filters, const std::vector<const ConfigTree*>& cell) {
  return std::ranges::any_of(filters, [&](const CellFilter& filter) {
    return std::ranges::all_of(filter.conditions, [&](const CellFilter::Condition& condition) {
      const ordered_json value = plain_value(*cell[condition.axis]);
      return std::ranges::any_of(condition.values, [&](const ordered_json& v) { return same_value(value, v); });
    });
  });
}

// For each axis the one whose counter it follows: itself, or the first of those that it is zipped with.
std::vector<std::size_t> leaders_of(const Sweep& sweep) {
  std::vector<std::size_t> leaders(sweep.axes.size());
  std::iota(leaders.begin(), leaders.end(), 0);
  for (const std::vector<std::size_t>& group : sweep.zipped) {
    const auto kept = [&](std::size_t i) { return !sweep.axes[i].replaced; };
    const auto first = std::ranges::find_if(group, kept);
    for (const std::size_t i : group) {
      if (kept(i)) leaders[i] = *first;
    }
  }
  return leaders;
}

}  // namespace

Sweep read_sweep(const ConfigTree& experiment) {
  const auto part = [&](std::string_view key) {
    const ConfigTree* tree = core::find_value(experiment, key);
    return tree != nullptr ? *tree : ConfigTree{};
  };
  const ConfigTree axes = part("axes");
  Sweep sweep{.origin = axes.origin, .axes = read_axes(axes), .zipped = {}, .skip = {}, .only = {}};
  sweep.zipped = read_zipped(part("zip"), sweep.axes);
  sweep.skip = read_filters(part("skip"), "experiment.skip", sweep.axes);
  std::vector<CellFilter> only = read_filters(part("only"), "experiment.only", sweep.axes);
  if (!only.empty()) sweep.only.push_back(std::move(only));
  return sweep;
}

void replace_axis(Sweep& sweep, const core::ConfigOverride& override) {
  const auto axis = std::ranges::find(sweep.axes, override.key, &Axis::key);
  if (axis != sweep.axes.end()) *axis = {override.key, {override.value}, true};
}

void keep_only(Sweep& sweep, const std::vector<std::string>& assignments) {
  CellFilter filter;
  for (const std::string& text : assignments) {
    const auto [key, value] = core::parse_override(text, "--only");
    const CellFilter::Condition condition = read_condition(sweep.axes, key, value, value.origin, key);
    const auto same = std::ranges::find(filter.conditions, condition.axis, &CellFilter::Condition::axis);
    if (same == filter.conditions.end()) {
      filter.conditions.push_back(condition);
    } else {
      same->values.insert(same->values.end(), condition.values.begin(), condition.values.end());
    }
  }
  if (!filter.conditions.empty()) sweep.only.push_back({filter});
}

std::vector<std::vector<const ConfigTree*>> cells_of(const Sweep& sweep) {
  const std::vector<std::size_t> leaders = leaders_of(sweep);
  std::size_t all = 1;
  for (std::size_t i = 0; i < leaders.size(); ++i) {
    if (leaders[i] == i) all *= sweep.axes[i].values.size();
    if (all > kMaxProduct) {
      throw core::config_error(sweep.origin, "experiment.axes",
                               fmt::format("more than {} cells before filters", kMaxProduct));
    }
  }
  std::vector<std::vector<const ConfigTree*>> cells;
  std::vector<std::size_t> step(leaders.size());
  for (std::size_t n = 0; n < all; ++n) {
    std::size_t rest = n;
    for (std::size_t i = leaders.size(); i-- > 0;) {
      if (leaders[i] != i) continue;
      step[i] = rest % sweep.axes[i].values.size();
      rest /= sweep.axes[i].values.size();
    }
    std::vector<const ConfigTree*> cell;
    cell.reserve(leaders.size());
    for (std::size_t i = 0; i < leaders.size(); ++i) cell.push_back(&sweep.axes[i].values[step[leaders[i]]]);
    const auto holds = [&](const std::vector<CellFilter>& filters) { return holds_one(filters, cell); };
    if (!holds(sweep.skip) && std::ranges::all_of(sweep.only, holds)) cells.push_back(std::move(cell));
  }
  if (cells.empty()) throw core::config_error(sweep.origin, "experiment.axes", "the filters leave no cell");
  if (cells.size() > kMaxCells) {
    throw core::config_error(sweep.origin, "experiment.axes",
                             fmt::format("{} cells; at most {}", cells.size(), kMaxCells));
  }
  return cells;
}

ordered_json plain_value(const ConfigTree& tree) {
  if (tree.kind == ConfigTree::Kind::kSequence) {
    ordered_json list = ordered_json::array();
    for (const ConfigTree& item : tree.items) list.push_back(plain_value(item));
    return list;
  }
  if (tree.quoted) return tree.scalar;
  const ordered_json parsed = ordered_json::parse(tree.scalar, nullptr, false);
  return parsed.is_discarded() ? ordered_json(tree.scalar) : parsed;
}

}  // namespace plumbline::tools
