// The trials of one cell in a few figures. Figures are over the trials that are ok; n counts all of them.
//   mean, median (signed where the quantity is), rmse = sqrt(mean of squares), std of the sample
//   mean_ci95   Student's t, of signed quantities: their bias
//   rmse_ci95   exact for signed Gaussian errors; else none below 20 trials, then by rms_interval (eval/statistics.h),
//               from kBootstrapTrials on by BCa (eval/bootstrap.h), from 10,000 on, where all agree, by the first again
//   q05, q95    empirical quantiles
//   nees_mean   not divided by the degrees of freedom, and the 95 % band of that mean over n consistent trials
//   within_3_sigma  share of trials in the 99.73 % region of the stated covariance, NEES <= chi2inv(0.9973, dof), for
//               a single parameter |e| <= 3 sigma; with Clopper and Pearson's interval. 0.9973 is expected.
//   nis         sum of squared whitened residuals over all trials, a chi-square variable of sum(residuals - parameters)
//               degrees of freedom where the noise is as the estimator believes; divided by these, with its 95 % band
// A NEES, NIS or efficiency is claimed only where every trial is ok: those that fail would have been the worst; and
// only of an estimator whose covariance is meant as one, not with a robust loss. No NIS where there is no NEES at all,
// as with exact prior means.
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
  double within_3_sigma = 0.0;
  Interval within_3_sigma_ci95;
};

// How long something took, over trials in some of which it did not happen.
struct ConvergenceSummary {
  int n_converged = 0;
  Interval share_ci95;
  std::optional<double> median_s;  // of all trials, those without counted as later; nothing where that is not finite
};

struct NisSummary {
  double dof = 0.0;  // over all trials
  double mean = 0.0;
  Interval band95;
};

// The Cramer-Rao bound, root of the mean square over the trials, and how near the errors come to it:
// efficiency = sqrt( sum e^2 / sum b^2 ), with the interval of the RMSE.
struct BoundSummary {
  double crlb = 0.0;
  std::optional<double> efficiency;  // nothing where a trial failed or kappa2 is above kLargestKappa2
  std::optional<Interval> efficiency_ci95;
};

struct MetricSummary {
  std::string name;
  double mean = 0.0;
  double rmse = 0.0;
  double median = 0.0;
  std::optional<double> std;  // nothing for a single trial
  double q05 = 0.0;
  double q95 = 0.0;
  std::optional<Interval> mean_ci95;
  std::optional<Interval> rmse_ci95;
  std::optional<NeesSummary> nees;
  std::optional<BoundSummary> bound;
};

struct CellSummary {
  nlohmann::ordered_json axes;  // {"full.key": value}
  int n = 0;
  int n_ok = 0;
  std::vector<MetricSummary> metrics;  // empty where no trial is ok
  std::optional<ConvergenceSummary> td_convergence;
  std::optional<NisSummary> nis;
  std::string note;  // why there is no NEES or efficiency where there might have been
};

// no_claim: the reason why no NEES and no efficiency may be claimed of these trials at all, if there is one.
// line_angle_deg and line_distance_m are left out where a trial has estimated no line and so has neither.
// Throws std::invalid_argument where two ok rows do not hold the same other metrics, with and without NEES alike: they
// are not of one cell.
CellSummary summarise(const std::vector<Row>& rows, nlohmann::ordered_json axes, const std::string& no_claim = {});

// {"axes", "n", "n_ok", "metrics": {NAME: {"mean", "rmse", "median", "std", "q05", "q95", "mean_ci95", "rmse_ci95",
//  "crlb", "efficiency", "efficiency_ci95", "nees_dof", "nees_mean", "nees_band95", "within_3_sigma",
//  "within_3_sigma_ci95"}}, "td_convergence": {"n_converged", "share_ci95", "median_s"}, "nis": {"dof", "mean",
//  "band95"}, "note"}; what is not there is left out.
nlohmann::ordered_json to_json(const CellSummary& cell);

}  // namespace plumbline::eval
