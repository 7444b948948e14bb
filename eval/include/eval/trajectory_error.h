// Absolute trajectory error (ATE). With S the alignment (eval/alignment.h) and pose k
//   position  |S p_est,k - p_truth,k|                      [m]
//   rotation  the angle of R_truth,k^T (R_S R_est,k)       [deg], in [0, 180]
//   yaw (absolute value), gravity: its parts               [deg], eval/attitude_error.h
// and over k the figures of eval/error_statistics.h; the relative errors of the aligned poses: eval/relative_error.h.
// Definitions and figures are those of evo (none, se3, sim3) and of rpg_trajectory_evaluation (posyaw).
//
// A run that cannot be scored is a failed run with a reason, never one with the error 0.
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>
#include <nlohmann/json_fwd.hpp>

#include "core/pose_file.h"
#include "core/time.h"
#include "eval/alignment.h"
#include "eval/association.h"
#include "eval/error_statistics.h"
#include "eval/relative_error.h"

namespace plumbline::eval {

// The errors of one pose after alignment, as perturbations of the truth (core/state.h).
struct PoseError {
  Eigen::Vector3d position_m;    // world
  Eigen::Vector3d rotation_rad;  // Log(R_truth^T R_aligned), body
};

struct AxisStatistics {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();  // signed
  Eigen::Vector3d rmse = Eigen::Vector3d::Zero();
};

struct TrajectoryErrorOptions {
  Alignment alignment = Alignment::kPosyaw;
  int first_n = 0;       // poses that decide the alignment; 0: all
  double first_s = 0.0;  // or those up to so long after the first; 0: all. Not both.
  core::TimeNs tolerance_ns = kDefaultToleranceNs;
  double min_coverage = 0.9;
  // Of the relative errors.
  std::vector<Delta> deltas = {};
};

struct TrajectoryErrors {
  bool ok = false;
  std::string reason;  // where not ok
  int matched = 0;
  double coverage = 0.0;
  int interpolated = 0;  // pairs whose truth was interpolated, over intervals of at most
  double largest_bridged_s = 0.0;
  Similarity truth_from_estimate;
  ErrorStatistics position_m;
  ErrorStatistics rotation_deg;
  ErrorStatistics yaw_deg;
  ErrorStatistics gravity_deg;
  AxisStatistics position_axes_m;        // x, y, z of the world
  AxisStatistics rotation_axes_deg;      // of the body
  std::vector<RelativeErrors> relative;  // one a delta
  std::vector<PosePair> pairs;           // before alignment
  std::vector<PoseError> errors;         // one a pair
};

inline constexpr int kMinPoses = 3;

// Of poses that belong together already. Fails on fewer than kMinPoses, values that are not finite, stamps that do
// not increase, and where the alignment is not determined. Tolerance and coverage play no part.
TrajectoryErrors trajectory_errors(const std::vector<PosePair>& pairs, const TrajectoryErrorOptions& options = {});

// Of an estimate that may be unusable (PoseFileOptions::allow_unusable) against a sound truth.
TrajectoryErrors trajectory_errors(const std::vector<core::StampedPose>& estimate,
                                   const std::vector<core::StampedPose>& truth,
                                   const TrajectoryErrorOptions& options = {});

// {"ok", "alignment", "matched", "coverage", "truth", "largest_bridged_s", "ate_position_m": {...}, "ate_rotation_deg",
//  "ate_yaw_deg", "ate_gravity_deg", "axes": {"position_m": {"mean": [x, y, z], "rmse"}, "rotation_deg"}, "rpe":
//  [...]};
// of a failed run {"ok", "reason", "alignment", "matched", "coverage"}. truth is "exact" where every pair has a true
// pose of its stamp, else "interpolated".
nlohmann::ordered_json to_json(const TrajectoryErrors& errors, Alignment alignment);

}  // namespace plumbline::eval
