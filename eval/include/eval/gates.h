// What a night is judged by, against a baseline over the same seeds. One gate a question, each with a verdict:
//   unchanged   every figure is the same to the bit: an identical rebuild, asked of no test
//   metric      red where the ratio of paired errors (eval/comparison.h) is above 1 + practical minimum and Holm's p at
//               most half of alpha; better likewise below 1 / (1 + minimum)
//   failures    red where more trials fail (McNemar) and Holm's p is at most half of alpha
//   consistency of the seeds of this night alone: red where a mean NEES leaves the chi-square band at confidence
//               1 - alpha / (2 m), m their number, and the baseline's own fresh seeds were within it
// Holm adjusts over all metrics and failures of all cells, so that a night without a change is red with a probability
// of at most alpha, for whatever dependence among the figures.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

#include "eval/comparison.h"

namespace plumbline::eval {

enum class GateKind { kIdentity, kMetric, kFailures, kConsistency };
inline constexpr std::array<std::string_view, 4> kGateKindNames = {"identity", "metric", "failures", "consistency"};

enum class GateVerdict { kUnchanged, kGreen, kBetter, kRed, kNotCompared };
inline constexpr std::array<std::string_view, 5> kGateVerdictNames = {"unchanged", "green", "better", "red",
                                                                      "not compared"};

struct Gate {
  std::string experiment;
  nlohmann::ordered_json axes;  // of the cell
  GateKind kind = GateKind::kMetric;
  std::string name;  // of the metric
  GateVerdict verdict = GateVerdict::kGreen;
  std::string message;  // with the figure, its interval and what it is compared with
  std::optional<MetricComparison> comparison;
  std::optional<int> trial = std::nullopt;  // the one that got worse most, to be looked at
};

// The mean NEES of a metric over seeds of one night.
struct FreshNees {
  std::string name;
  int dof = 0;
  int n = 0;
  double mean = 0.0;
};

// A cell tonight and in the baseline, the same trials in the same order. Without a baseline there is only tonight's.
struct JudgedCell {
  std::string experiment;
  CellOutcomes tonight;
  std::optional<CellOutcomes> baseline;
  std::vector<FreshNees> fresh;
  std::vector<FreshNees> baseline_fresh;
};

struct GateRules {
  double alpha = 0.01;
  double practical_minimum = 0.01;
  std::vector<std::string> metrics = {};  // all of tables where empty
};

// By cell: one identity gate where all is the same, else a gate for the failures and each metric; then consistency.
std::vector<Gate> judge_night(const std::vector<JudgedCell>& cells, const GateRules& rules);

bool is_red(const std::vector<Gate>& gates);

}  // namespace plumbline::eval
