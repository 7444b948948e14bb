// The least-squares problem of a batch estimate: parameter blocks, factors, and the ceres::Problem that joins them.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include <Eigen/Core>
#include <ceres/loss_function.h>
#include <ceres/problem.h>

#include "core/estimate.h"
#include "estimator/batch_values.h"
#include "estimator/factors/parameter_blocks.h"
#include "estimator/line_terms.h"
#include "estimator/point_terms.h"

namespace plumbline::estimator {

class BatchProblem {
 public:
  // Linearises inertial factors and local motions about the biases in `values`. Points and lines whose factors
  // cannot be evaluated there (behind a camera) are left out and lose their value.
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

  // The tracks of lines that an observed end is further from than so many sigmas, at the present values.
  std::vector<std::size_t> lines_beyond(double sigmas) const;

 private:
  using Timings = std::vector<FrameTiming>;  // of the keyframes

  // Of the residual blocks [first, last) in the order in which they were added, without loss functions.
  core::ResidualSum residual_sum(int first, int last) const;

  void add_priors();
  void add_inertial_factors();
  Timings frame_timings() const;
  void add_points(const Timings& timings);
  bool add_point(const PointModel& model, const Timings& timings, const Track& track, Eigen::Vector3d& landmark);
  double* landmark_block(Eigen::Vector3d& landmark) const;  // what of it is estimated
  void add_lines(const Timings& timings);
  bool add_line(const LineModel& model, const Timings& timings, std::size_t track, LineValue& line);

  const BatchInput& input_;
  BatchValues start_;
  std::vector<StateBlock> states_;
  PoseBlock extrinsics_;
  double td_s_;
  double readout_s_;
  std::vector<Eigen::Vector3d> landmarks_;
  std::vector<std::size_t> landmark_tracks_;
  std::vector<LineValue> lines_;
  std::vector<std::size_t> line_tracks_;
  struct LineResidual {
    std::size_t track;
    ceres::ResidualBlockId block;
  };
  std::vector<LineResidual> line_residuals_;
  int observations_ = 0;
  int inertial_begin_ = 0;  // the residual blocks: priors, then inertial, then visual ones
  int visual_begin_ = 0;
  StateManifold state_manifold_;
  PoseManifold pose_manifold_;
  OrthonormalLineManifold line_manifold_;
  std::unique_ptr<ceres::LossFunction> loss_;  // of visual residuals; null: none
  std::unique_ptr<ceres::Problem> problem_;
};

}  // namespace plumbline::estimator
