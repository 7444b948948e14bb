// A trial as it went, on a fixed grid of at most kSeriesPoints instants (the estimated states nearest to them), for
// plots and for looking into a single run.
#pragma once

#include <vector>

#include <Eigen/Core>
#include <nlohmann/json_fwd.hpp>

#include "core/estimate.h"
#include "core/lie.h"
#include "core/time.h"
#include "eval/trajectory_error.h"

namespace plumbline::eval {

inline constexpr int kSeriesPoints = 100;

struct SeriesPoint {
  double t_s = 0.0;    // since the first estimated state
  PoseError error;     // after alignment
  core::Pose aligned;  // the estimated T_W_B after alignment
  core::Pose truth;    // T_W_B
};

struct TimeOffsetPoint {
  double t_s = 0.0;  // since the first estimated state
  double td_error_s = 0.0;
  double sigma_s = 0.0;
};

// What an online estimator knew at an instant, unaligned: how sure it was, and its NEES.
struct OnlinePoint {
  double t_s = 0.0;  // since the first estimated state
  Eigen::Vector3d position_sigma_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d orientation_sigma_rad = Eigen::Vector3d::Zero();
  double position_nees = 0.0;     // 3 dof
  double orientation_nees = 0.0;  // 3 dof
  double pose_nees = 0.0;         // 6 dof, [position | orientation]
  double velocity_nees = 0.0;     // 3 dof
  double bias_nees = 0.0;         // 6 dof, [gyroscope | accelerometer]
};

// Roots of the Cramer-Rao bound from the measurements up to an instant (eval/cramer_rao.h), of a vector that of the
// trace: the least that an online estimator's standard deviation can be. 0 for what is held.
struct BoundPoint {
  double t_s = 0.0;  // since the first estimated state
  double td_s = 0.0;
  double readout_s = 0.0;
  double position_m = 0.0;  // of that instant's state, unaligned
  double orientation_rad = 0.0;
  double position_in_the_end_m = 0.0;  // of the same state from all measurements
  double orientation_in_the_end_rad = 0.0;
};

struct Series {
  std::vector<SeriesPoint> points;
  std::vector<TimeOffsetPoint> td;  // empty where the estimator keeps no history
  std::vector<OnlinePoint> online;  // likewise
  std::vector<BoundPoint> bound;    // empty without eval.crlb
};

// The indices of at most `points` of the sorted stamps: those nearest to a uniform grid from the first to the last.
std::vector<int> grid_indices(const std::vector<core::TimeNs>& stamps, int points = kSeriesPoints);

// `errors` of `pairs`, which must be ok; td_s is the true one.
Series make_series(const std::vector<PosePair>& pairs, const TrajectoryErrors& errors,
                   const std::vector<core::TimeOffsetEstimate>& td_history, double td_s);

// Columns as arrays: {"t_s": [...], "position_error_m": [x, y, z], "rotation_error_rad": [x, y, z],
//  "estimate": [px, py, pz, qx, qy, qz, qw], "truth": likewise, "td": {"t_s", "td_error_s", "sigma_s"},
//  "nees": {"t_s", "pose", "velocity", "bias"}, "bound": {"t_s", "td_s", "readout_s", "position_m", "orientation_rad",
//  "position_in_the_end_m", "orientation_in_the_end_rad"}}, each letter an array; td and nees only where there is a
// history, bound only with eval.crlb.
nlohmann::ordered_json to_json(const Series& series);

}  // namespace plumbline::eval
