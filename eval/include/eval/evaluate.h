// A trial's estimate against its truth.
//
//   error = estimate - truth for positions, velocities, biases, td, readout;   Log(R_truth^T R_est) for orientations:
// the estimator's own perturbation, so that its covariance speaks of the same thing. The truth is taken at the stamps
// of the estimated states; the ATE is of all of them, everything else is unaligned. What is measured: eval/metrics.h.
#pragma once

#include <string>
#include <vector>

#include "core/estimate.h"
#include "eval/alignment.h"
#include "eval/metrics.h"
#include "eval/series.h"
#include "eval/td_convergence.h"
#include "sim/ground_truth.h"

namespace plumbline::eval {

struct MetricsConfig {
  Alignment alignment = Alignment::kPosyaw;
  int first_n = 0;                // poses that decide the alignment; 0: all
  double first_s = 0.0;           // or those up to so long after the first; 0: all. Not both.
  bool crlb = false;              // the Cramer-Rao bound of each trial
  double td_bound_s = kTdBoundS;  // td_convergence_s: what |td error| must stay within
};

struct SolverFigures {
  int iterations = 0;
  double final_cost = 0.0;    // half the sum of squares
  double cost_per_dof = 0.0;  // 1 where the noise is as stated
  int observations = 0;
  int landmarks = 0;
};

struct TrialResult {
  bool ok = false;
  std::string status;           // of kSolveStatusNames, or "unusable": converged, but not to be scored
  std::string reason;           // one line where not ok
  std::vector<Metric> metrics;  // empty where not ok, else finite
  SolverFigures solver;
  Series series;  // empty where not ok
};

// NEES is given for what was estimated: calibration by its flags, a block of the last state where its covariance is
// not zero, and nothing where the whole covariance is zero (an estimator that states none).
// Not ok where the estimate did not converge, has fewer than kMinPoses states, values that are not finite, unsorted or
// duplicate stamps or stamps outside the recording, where the alignment is not determined, or where the covariance of
// something estimated is not positive definite.
TrialResult evaluate(const core::EstimateLog& estimate, const sim::GroundTruth& truth, const MetricsConfig& config);

}  // namespace plumbline::eval
