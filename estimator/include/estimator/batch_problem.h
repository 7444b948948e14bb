// The least-squares problem of a batch estimate: parameter blocks and the factors that join them.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include <Eigen/Core>
#include <ceres/cost_function.h>
#include <ceres/loss_function.h>

#include "core/estimate.h"
#include "estimator/batch_values.h"
#include "estimator/factors/parameter_blocks.h"
#include "estimator/least_squares.h"
#include "estimator/line_terms.h"
#include "estimator/point_terms.h"
#include "estimator/schur_system.h"

namespace plumbline::estimator {

// How the problem is solved. Each step of all parameters is followed by the landmarks' own best values for its poses
// (landmark_descent.h). Otherwise landmarks that it sends behind a camera or past infinity, lines more than points,
// shorten every step.
enum class SolvePhase {
  kSearch,  // loosely, from a poor start; visual residuals have a Cauchy loss, lest a wrong landmark pull the poses
            // along
  kRefine,  // to the minimum of what estimator.loss asks for
};

class BatchProblem {
 public:
  // Linearises inertial factors and local motions about the biases in `values`. Points and lines whose factors
  // cannot be evaluated there (behind a camera) are left out and lose their value.
  BatchProblem(const BatchInput& input, const BatchValues& values, SolvePhase phase = SolvePhase::kRefine);

  struct Outcome {
    core::SolveStatus status = core::SolveStatus::kDiverged;
    core::SolveSummary summary;
  };
  Outcome solve();

  BatchValues values() const;

  // Of calibration and last state, at the present values.
  std::optional<core::PosteriorCovariance> covariance();

  // At the present values; nothing where the trajectory is not a spline.
  std::optional<core::KnotCheck> knot_check() const;

  // The tracks of lines that an observed end is further from than so many sigmas, at the present values.
  std::vector<std::size_t> lines_beyond(double sigmas) const;

 private:
  using Timings = std::vector<FrameTiming>;  // of the keyframes

  // Of the terms [first, last), without loss functions.
  core::ResidualSum residual_sum(std::size_t first, std::size_t last) const;

  // A factor and the blocks it speaks of, the landmark's left out where it comes last.
  struct Term {
    std::unique_ptr<const ceres::CostFunction> factor;
    std::vector<int> blocks;
  };
  int add_block(ParameterBlock block);
  void add_term(Term term, const ceres::LossFunction* loss);
  bool add_landmark(ParameterBlock landmark, std::vector<Term> terms);
  int state_block(std::size_t keyframe) const { return static_cast<int>(keyframe + 1); }
  void add_priors();
  void add_inertial_factors();
  Timings frame_timings() const;
  void add_points(const Timings& timings);
  bool add_point(const PointModel& model, const Timings& timings, const Track& track, Eigen::Vector3d& landmark);
  void add_lines(const Timings& timings);
  bool add_line(const LineModel& model, const Timings& timings, std::size_t track, LineValue& line);

  // Of a trajectory spline, whose timings count from its origin.
  void add_spline_blocks();
  std::vector<int> blocks_at(const SplineInstant& at) const;
  Term spline_term(std::unique_ptr<SplineVisual> factor) const;
  Term spline_point(const PointModel& model, const Timings& timings, const TrackObservation& anchor,
                    const TrackObservation& observer) const;
  Term spline_line(const LineModel& model, const Timings& timings, const LineTrackObservation& o,
                   const Eigen::Vector3d& origin_W) const;
  void add_spline_inertial_factors();
  core::State state_on_spline(core::TimeNs t_ns) const;
  Eigen::MatrixXd newest_state_by_columns(const SchurSystem& system, int calibration) const;

  const BatchInput& input_;
  SolvePhase phase_;
  BatchValues start_;
  std::vector<StateBlock> states_;
  std::optional<TrajectorySpline> spline_;  // in place of the states
  std::vector<int> control_blocks_;
  std::vector<int> bias_blocks_;
  PoseBlock extrinsics_;
  double td_s_;
  double readout_s_;
  std::vector<Eigen::Vector3d> landmarks_;
  std::vector<std::size_t> landmark_tracks_;
  std::vector<LineValue> lines_;
  std::vector<std::size_t> line_tracks_;
  int observations_ = 0;
  // The terms: those of points, of lines, inertial ones, priors.
  std::size_t line_begin_ = 0;
  std::size_t inertial_begin_ = 0;
  std::size_t prior_begin_ = 0;
  StateManifold state_manifold_;
  PoseManifold pose_manifold_;
  OrthonormalLineManifold line_manifold_;
  std::unique_ptr<ceres::LossFunction> loss_;                        // of visual residuals; null: none
  std::vector<std::unique_ptr<const ceres::CostFunction>> factors_;  // of the terms
  int extrinsics_block_ = -1;
  int td_block_ = -1;
  int readout_block_ = -1;
  int first_line_block_ = 0;
  LeastSquares problem_;
  std::optional<SchurSystem> system_;
};

}  // namespace plumbline::estimator
