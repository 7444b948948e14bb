// Absolute trajectory error (ATE). With S the alignment (eval/alignment.h) and pose k
//   position  |S p_est,k - p_truth,k|                      [m]
//   rotation  the angle of R_truth,k^T (R_S R_est,k)       [deg], in [0, 180]
// and over k: rmse, mean, median, std (of the population, so that rmse^2 = mean^2 + std^2), min, max.
// Definitions and figures are those of evo (none, se3, sim3) and of rpg_trajectory_evaluation (posyaw).
//
// A run that cannot be scored is a failed run with a reason, never one with the error 0.
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>
#include <nlohmann/json.hpp>

#include "core/pose_file.h"
#include "core/time.h"
#include "eval/alignment.h"
#include "eval/association.h"

namespace plumbline::eval {

struct ErrorStatistics {
  double rmse = 0.0;
  double mean = 0.0;
  double median = 0.0;
  double std = 0.0;
  double min = 0.0;
  double max = 0.0;
};

// The errors of one pose after alignment, as perturbations of the truth (core/state.h).
struct PoseError {
  Eigen::Vector3d position_m;    // world
  Eigen::Vector3d rotation_rad;  // Log(R_truth^T R_aligned), body
};

struct TrajectoryErrorOptions {
  Alignment alignment = Alignment::kPosyaw;
  int first_n = 0;  // poses that decide the alignment; 0: all
  core::TimeNs tolerance_ns = kDefaultToleranceNs;
  double min_coverage = 0.9;
};

struct TrajectoryErrors {
  bool ok = false;
  std::string reason;  // where not ok
  int matched = 0;
  double coverage = 0.0;
  Similarity truth_from_estimate;
  ErrorStatistics position_m;
  ErrorStatistics rotation_deg;
  std::vector<PoseError> errors;  // one a matched pose
};

inline constexpr int kMinPoses = 3;

// Of poses that belong together already. Fails on fewer than kMinPoses, values that are not finite, stamps that do
// not increase, and where the alignment is not determined. Tolerance and coverage play no part.
TrajectoryErrors trajectory_errors(const std::vector<PosePair>& pairs, const TrajectoryErrorOptions& options = {});

// Of an estimate that may be unusable (PoseFileOptions::allow_unusable) against a sound truth.
TrajectoryErrors trajectory_errors(const std::vector<core::StampedPose>& estimate,
                                   const std::vector<core::StampedPose>& truth,
                                   const TrajectoryErrorOptions& options = {});

ErrorStatistics error_statistics(const std::vector<double>& errors);  // not empty

// {"ok", "alignment", "matched", "coverage", "ate_position_m": {...}, "ate_rotation_deg": {...}}; of a failed run
// {"ok", "reason", "alignment", "matched", "coverage"}.
nlohmann::ordered_json to_json(const TrajectoryErrors& errors, Alignment alignment);

}  // namespace plumbline::eval
