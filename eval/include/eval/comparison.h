// Two variants over the same trials: is B worse than A? Trials are paired by (axes of the cell, trial, seed), so that
// both have met the same noise.
//   a metric    d = ln(|B| / |A|) over the trials that are ok in both, 0 where both are equal.
//               ratio exp(median of the Walsh averages of d), its interval and p value by the signed rank test
//               (eval/signed_rank.h), which takes d as symmetric about the ratio; the sample median beside it
//   failures    McNemar's exact test of those that fail in one only
// p values are adjusted over all metrics and cells (Holm). B is worse where an adjusted one is at most alpha and the
// ratio above 1, or more trials fail. The power is stated: the smallest ratio that would have been found in four of
// five repetitions, given the spread of d, n, and the strictest level that Holm asks for.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "eval/result_store.h"
#include "eval/statistics.h"

namespace plumbline::eval {

struct TrialOutcome {
  int trial = 0;
  std::uint64_t seed = 0;
  bool ok = false;
  std::vector<double> values;  // of CellOutcomes::metrics; empty where not ok
};

// What a comparison needs of the rows of a cell.
struct CellOutcomes {
  nlohmann::ordered_json axes;  // {"full.key": value}
  std::vector<std::string> metrics;
  std::vector<TrialOutcome> trials;

  void add(const Row& row);  // throws core::DataError where its metrics are others than those before
};

struct MetricComparison {
  std::string name;
  int pairs = 0;
  double rmse_a = 0.0;
  double rmse_b = 0.0;
  double ratio = 1.0;
  double median_ratio = 1.0;
  std::optional<Interval> ratio_ci95;  // needs 6 pairs
  double p = 1.0;
  double p_holm = 1.0;
  std::optional<double> detectable_ratio;  // > 1
  std::string not_compared;                // why, where p is not of a test
};

struct CellComparison {
  nlohmann::ordered_json axes;
  int n = 0;
  int n_ok_a = 0;
  int n_ok_b = 0;
  int only_a_failed = 0;
  int only_b_failed = 0;
  double p_failures = 1.0;
  double p_failures_holm = 1.0;
  std::vector<MetricComparison> metrics;
};

struct Comparison {
  std::vector<CellComparison> cells;
  double alpha = 0.05;
  int tests = 0;
  bool worse = false;
};

// `metrics`: the names to compare; empty: those of tables that both have. Throws core::DataError where cells, trials or
// seeds of A and B do not match, or one has no such metric.
Comparison compare(const std::vector<CellOutcomes>& a, const std::vector<CellOutcomes>& b,
                   const std::vector<std::string>& metrics = {}, double alpha = 0.05);

// {"worse", "alpha", "tests", "cells": [{"axes", "n", "n_ok_a", "n_ok_b", "only_a_failed", "only_b_failed",
//  "p_failures", "p_failures_holm", "metrics": {NAME: {"pairs", "rmse_a", "rmse_b", "ratio", "median_ratio",
//  "ratio_ci95", "p", "p_holm", "detectable_ratio"}}}]}; "not_compared" in place of all from "ratio" on.
nlohmann::ordered_json to_json(const Comparison& comparison);

// For a terminal of 100 columns.
std::string comparison_table(const Comparison& comparison);

}  // namespace plumbline::eval
