// The trials of one cell in a few figures. Figures are over the trials that are ok; n counts all of them.
//   mean, median (signed where the quantity is), rmse = sqrt(mean of squares), std of the sample
//   rmse_ci95   exact for signed Gaussian errors, else by rms_interval (eval/statistics.h); with two trials at least
//   nees_mean   not divided by the degrees of freedom, and the 95 % band of that mean over n consistent trials
// A NEES is claimed only where every trial is ok: those that fail would have been the worst.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "eval/result_store.h"
#include "eval/statistics.h"

namespace plumbline::eval {

struct NeesSummary {
  int dof = 0;
  double mean = 0.0;
  Interval band95;
};

struct MetricSummary {
  std::string name;
  double mean = 0.0;
  double rmse = 0.0;
  double median = 0.0;
  std::optional<double> std;  // nothing for a single trial
  std::optional<Interval> rmse_ci95;
  std::optional<NeesSummary> nees;
};

struct CellSummary {
  nlohmann::ordered_json axes;  // {"full.key": value}
  int n = 0;
  int n_ok = 0;
  std::vector<MetricSummary> metrics;  // empty where no trial is ok
  std::string note;                    // why there is no NEES where there might have been
};

// Throws std::invalid_argument where two ok rows do not hold the same metrics, with and without NEES alike: they are
// not of one cell.
CellSummary summarise(const std::vector<Row>& rows, nlohmann::ordered_json axes);

// {"axes", "n", "n_ok", "metrics": {NAME: {"mean", "rmse", "median", "std", "rmse_ci95", "nees_dof", "nees_mean",
//  "nees_band95"}}, "note"}; what is not there is left out.
nlohmann::ordered_json to_json(const CellSummary& cell);

}  // namespace plumbline::eval
