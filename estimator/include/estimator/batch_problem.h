// The least-squares problem of a batch estimate: parameter blocks, factors, and the ceres::Problem that joins them.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include <Eigen/Core>
#include <ceres/problem.h>

#include "core/estimate.h"
#include "core/measurements.h"
#include "estimator/config.h"
#include "estimator/factors/local_motion.h"
#include "estimator/factors/parameter_blocks.h"
#include "estimator/keyframes.h"
#include "estimator/point_terms.h"

namespace plumbline::estimator {

// What stays the same while the estimate grows.
struct BatchInput {
  const core::MeasurementLog& log;
  const EstimatorConfig& config;
  BelievedNoise noise;
  std::vector<std::size_t> keyframes;  // indices of frames
  std::vector<Track> tracks;
};

// The values found so far. State 0 is the prior's, state k + 1 that of keyframe k.
struct BatchValues {
  core::RigCalibration calibration;
  std::vector<std::size_t> samples;  // the IMU sample of each state
  std::vector<core::State> states;
  std::vector<std::optional<Eigen::Vector3d>> landmarks;  // (x, y, lambda) a track
};

class BatchProblem {
 public:
  // Linearises inertial factors and local motions about the biases in `values`. Landmarks whose factors cannot be
  // evaluated there (behind a camera) are left out and lose their value.
  BatchProblem(const BatchInput& input, const BatchValues& values);

  struct Outcome {
    core::SolveStatus status = core::SolveStatus::kDiverged;
    core::SolveSummary summary;
  };
  struct SolveOptions {
    int max_iterations = 50;
    double function_tolerance = 1e-9;  // relative
    // Practically Gauss-Newton while it works (the start is close); Ceres damps by itself where a step fails.
    double initial_trust_region_radius = 1e12;
  };
  Outcome solve(const SolveOptions& options);

  BatchValues values() const;

  // Of calibration and last state, at the present values.
  std::optional<core::PosteriorCovariance> posterior_covariance() const;

 private:
  // Of the residual blocks [first, last) in the order in which they were added, without loss functions.
  core::ResidualSum residual_sum(int first, int last) const;

  void add_priors();
  void add_inertial_factors();
  void add_points();
  bool add_point(const PointModel& model, const std::vector<FrameTiming>& timings, const Track& track,
                 Eigen::Vector3d& landmark);
  double* landmark_block(Eigen::Vector3d& landmark) const;  // what of it is estimated

  const BatchInput& input_;
  BatchValues start_;
  std::vector<StateBlock> states_;
  PoseBlock extrinsics_;
  double td_s_;
  double readout_s_;
  std::vector<Eigen::Vector3d> landmarks_;
  std::vector<std::size_t> landmark_tracks_;
  int observations_ = 0;
  int inertial_begin_ = 0;  // the residual blocks: priors, then inertial, then visual ones
  int visual_begin_ = 0;
  StateManifold state_manifold_;
  PoseManifold pose_manifold_;
  std::unique_ptr<ceres::Problem> problem_;
};

}  // namespace plumbline::estimator
