// `plumbline ba` and `plumbline simulate-ba`: see docs/bundle_adjustment.md. Exit codes as in commands.h; an adjustment
// that does not converge is 1.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>

#include "estimator/bundle_adjustment.h"
#include "sim/bal_world.h"

namespace plumbline::tools {

struct BaOptions {
  std::filesystem::path problem;
  estimator::BundleOptions adjustment;
  std::optional<std::filesystem::path> truth;
  std::optional<std::filesystem::path> out;
  bool json = false;
};
int ba(const BaOptions& options);

struct SimulateBaOptions {
  std::filesystem::path out;
  std::uint64_t seed = 1;
  sim::BalWorldConfig world;
};
int simulate_ba(const SimulateBaOptions& options);

}  // namespace plumbline::tools
