// What a night hands out: a page, JUnit XML for a build server, Markdown for a message.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "tools/history.h"

namespace plumbline::tools {

// How the estimator's processor time compares over the same trials: said, but no reason for red.
struct RuntimeChange {
  std::string experiment;
  nlohmann::ordered_json axes;
  double median_s = 0.0;
  double baseline_s = 0.0;
  double ratio = 1.0;
  bool slower = false;
};

struct NightReport {
  Night night;
  std::optional<Night> baseline;
  std::vector<RuntimeChange> runtime;
  std::vector<TrendPoint> trends;
  std::vector<std::string> metrics;  // that are judged
  bool across_scenarios = false;
  std::filesystem::path out;
};

// The same cell of the baseline, whose trials can be paired; nullptr without one.
const NightCell* find_partner(const std::optional<Night>& baseline, const NightCell& cell, bool across_scenarios);

// One case a gate; those that are red fail, those that were not compared are skipped.
std::string junit_xml(const NightReport& report);

std::string night_markdown(const NightReport& report);

// For tools/report: {"kind": "nightly", ...}.
nlohmann::ordered_json night_data(const NightReport& report);

// "red: 2 of 31 gates", and a sentence each on what else to know.
std::string night_headline(const NightReport& report);
std::vector<std::string> night_findings(const NightReport& report);

}  // namespace plumbline::tools
