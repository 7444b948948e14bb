// The cells of an experiment: which values its axes take together.
//
//   experiment:
//     axes:                                         a full key each; the cells are the product, the last varying
//     fastest
//       scenario.camera.td_s: [0, 0.02]
//       scenario.camera.readout_s: {linspace: [0, 0.03, 4]}       a + (b - a) i / (n - 1)
//       scenario.camera.pixel_sigma_px: {logspace: [0.1, 10, 3]}  a (b / a)^(i / (n - 1)), to 12 digits
//       scenario.imu.rate_hz: [100, 200, 400]
//     zip: [[scenario.camera.pixel_sigma_px, scenario.imu.rate_hz]]  step together, in the place of the first
//     skip: [{scenario.camera.td_s: 0.02, scenario.camera.readout_s: [0, 0.01]}]
//     only: [{...}, ...]
//
// i = 0 .. n-1; the first and the last value of a range are a and b to the last bit (those of logspace too: they are
// values, not exponents). A map of skip or only is a filter: it holds for the cells in which each of its keys has its
// value, or one of its list of values. Left out are the cells for which one of skip holds, or none of an only.
#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

#include "core/config_tree.h"

namespace plumbline::tools {

inline constexpr std::array<std::string_view, 4> kSweepKeys = {"axes", "zip", "skip", "only"};
inline constexpr std::size_t kMaxProduct = 100'000;  // cells before filters
inline constexpr std::size_t kMaxCells = 1'000;      // after them; a manifest holds each whole and must be read again

struct Axis {
  std::string key;
  std::vector<core::ConfigTree> values;
  bool replaced = false;  // by an override: its one value is told to filters, but names no cell
};

// The cells in which each of these axes has one of these values.
struct CellFilter {
  struct Condition {
    std::size_t axis = 0;
    std::vector<nlohmann::ordered_json> values;
  };
  std::vector<Condition> conditions;
};

struct Sweep {
  core::Origin origin;  // of the axes
  std::vector<Axis> axes;
  std::vector<std::vector<std::size_t>> zipped;  // axes, ascending
  std::vector<CellFilter> skip;
  std::vector<std::vector<CellFilter>> only;  // of each list, one filter at least must hold
};

// Of the map `experiment`, whose other keys are of no concern here. Throws core::ConfigError, as do all below.
Sweep read_sweep(const core::ConfigTree& experiment);

// An override of an axis' key leaves that value alone; of any other key nothing.
void replace_axis(Sweep& sweep, const core::ConfigOverride& override);

// KEY=VALUE each, as of --only; those of one key are alternatives.
void keep_only(Sweep& sweep, const std::vector<std::string>& assignments);

// The value of each axis, for every cell in order.
std::vector<std::vector<const core::ConfigTree*>> cells_of(const Sweep& sweep);

// A scalar or list as it stands in the file: a number where it is one.
nlohmann::ordered_json plain_value(const core::ConfigTree& tree);

}  // namespace plumbline::tools
