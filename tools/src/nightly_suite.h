// The suite of a nightly: a YAML file with the rules and the experiments, each an ordinary experiment file.
//
//   nightly: {trials: 50, fresh_trials: 10, quick_trials: 5, alpha: 0.01, practical_minimum: 0.01}
//   experiments: [nightly/batch.yaml, nightly/online.yaml]        relative to the suite's file
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "core/config.h"

namespace plumbline::tools {

struct NightlyConfig {
  int trials = 50;
  int fresh_trials = 10;
  int quick_trials = 5;
  std::uint64_t seed = 1;
  double alpha = 0.01;
  double practical_minimum = 0.01;
  double runtime_ratio = 1.25;
};
void visit(core::ConfigVisitor& v, NightlyConfig& c);

struct NightlySuite {
  NightlyConfig rules;
  std::vector<std::filesystem::path> experiments;
  std::vector<std::string> metrics;  // that are judged
};

// Throws core::ConfigError; every experiment is checked.
NightlySuite load_suite(const std::filesystem::path& file);

}  // namespace plumbline::tools
