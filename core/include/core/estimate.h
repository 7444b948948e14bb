// What an estimator answers.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "core/calibration.h"
#include "core/state.h"
#include "core/time.h"

namespace plumbline::core {

enum class SolveStatus {
  kConverged,
  kIterationLimit,
  kDiverged,              // the solver could not reduce the cost
  kKnotsTooCoarse,        // of a trajectory spline, which leaves more of the IMU's samples than their noise
  kFalseMinimum,          // converged where the residuals are far larger than their noise
  kFailedInitialisation,  // too little data, or no starting point in front of the camera
};
inline constexpr std::array<std::string_view, 6> kSolveStatusNames = {
    "converged", "iteration_limit", "diverged", "knots_too_coarse", "false_minimum", "failed_initialisation"};

struct StampedState {
  TimeNs t_ns = 0;  // IMU clock
  State state;
};

// The joint posterior covariance of calibration and last state, in the perturbations of docs/conventions.md:
//   [ p_B_C | theta_B_C | td (middle row) | readout | last state (15) | fx, fy, cx, cy ]
// Rows and columns of a parameter that was held fixed are zero.
inline constexpr int kCovExtrinsicPosition = 0;
inline constexpr int kCovExtrinsicRotation = 3;
inline constexpr int kCovTd = 6;
inline constexpr int kCovReadout = 7;
inline constexpr int kCovLastState = 8;
inline constexpr int kCovIntrinsics = kCovLastState + kStateDof;
inline constexpr int kCovDim = kCovIntrinsics + 4;
using PosteriorCovariance = Eigen::Matrix<double, kCovDim, kCovDim>;

// The online history of td: what the estimator knew at an instant.
struct TimeOffsetEstimate {
  TimeNs t_ns = 0;  // IMU clock
  double td_s = 0.0;
  double sigma_s = 0.0;
};

// The online history of the state: what the estimator knew at an instant, from the data up to it.
using StateCovariance = Eigen::Matrix<double, kStateDof, kStateDof>;
struct OnlineState {
  TimeNs t_ns = 0;  // IMU clock
  State state;
  StateCovariance covariance = StateCovariance::Zero();  // in the order of core/state.h
};

// An estimated line through P with unit direction d: (n, d) in the world, n = P x d [m].
struct LineEstimate {
  std::int64_t track_id = 0;
  Eigen::Vector3d moment_W = Eigen::Vector3d::Zero();
  Eigen::Vector3d direction_W = Eigen::Vector3d::UnitX();
};

// Whitened residuals of one kind at the solution. Their sum of squares is smaller than their number even where the
// noise is as stated, since the parameters were fitted to them; only the sum over all kinds has a known number of
// degrees of freedom, residuals - parameters.
struct ResidualSum {
  double squares = 0.0;
  int residuals = 0;
};

struct SolveSummary {
  int iterations = 0;
  double initial_cost = 0.0;  // half the sum of squares
  double final_cost = 0.0;
  int residuals = 0;
  int parameters = 0;
  int landmarks = 0;
  int observations = 0;
  ResidualSum visual;
  ResidualSum inertial;
  ResidualSum prior;

  // Mean squared whitened residual per degree of freedom; 1 is expected where the noise is as stated.
  double cost_per_dof() const { return residuals > parameters ? 2.0 * final_cost / (residuals - parameters) : 0.0; }
};

// Whether the knots of a trajectory spline are dense enough: of the six channels of the IMU the one with the largest
// sum of squares of whitened residuals, less its number of samples n, over sqrt(2 n). Dense knots leave it near 0,
// below 4.5 but for twenty cases in a million, and the less the more controls were fitted.
struct KnotCheck {
  static constexpr double kMostSigmas = 4.5;
  double interval_s = 0.0;
  double excess_sigmas = 0.0;
};

// How an estimate came to its first states without being told them. World: the first of them at the origin, z up, any
// yaw.
struct Initialisation {
  TimeNs since_ns = 0;                // IMU clock: the first sample
  TimeNs at_ns = 0;                   // the newest of the states
  std::vector<StampedState> aligned;  // by geometry alone
  std::vector<StampedState> states;   // refined
  double relative_scale_sigma = 0.0;  // of the refined ones
};

struct EstimateLog {
  SolveStatus status = SolveStatus::kFailedInitialisation;
  std::string reason;  // one line where the status is not kConverged
  std::vector<StampedState> states;
  RigCalibration calibration;  // with intrinsics where they were estimated
  bool td_estimated = false;
  bool readout_estimated = false;
  bool extrinsics_estimated = false;
  PosteriorCovariance covariance = PosteriorCovariance::Zero();
  std::vector<TimeOffsetEstimate> td_history;
  std::vector<LineEstimate> lines;
  int line_tracks = 0;                           // of lines that two keyframes or more see; estimated or not
  std::vector<OnlineState> state_history;        // empty where the estimator keeps none
  std::optional<Initialisation> initialisation;  // from scratch; absent where it began from the prior
  std::optional<int> restarts;                   // how often it began anew after a failure; absent where it may not
  std::optional<KnotCheck> knots;                // where the trajectory is a spline
  SolveSummary summary;
};

}  // namespace plumbline::core
