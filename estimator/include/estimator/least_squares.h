// The least-squares problem of an estimate, and the two ways to solve it:
//   min  |r_prior|^2/2 + sum_i rho(|r_i|^2)/2
// over parameter blocks of which some, the landmarks, meet each other in no term: they are eliminated first (Schur
// complement). Ceres is the reference; `schur` does the same with less bookkeeping (schur_system.h).
#pragma once

#include <array>
#include <vector>

#include <ceres/cost_function.h>
#include <ceres/loss_function.h>
#include <ceres/manifold.h>

#include "core/estimate.h"
#include "estimator/factors/spline_path.h"
#include "estimator/marginal_prior.h"

namespace plumbline::estimator {

struct ParameterBlock {
  double* values = nullptr;
  int size = 0;
  int dof = 0;
  const ceres::Manifold* manifold = nullptr;  // null: plain numbers
  bool constant = false;
  bool eliminated = false;
  // What is added to its information when it is eliminated, of the last of its numbers and as a share of the diagonal:
  // what no observation tells must not be divided by.
  double last_information = 0.0;
  double share_of_information = 0.0;
};

inline constexpr int kMostBlocks = 2 * kMostControls + 4;  // of a term: a point seen from a spline

struct ResidualTerm {
  const ceres::CostFunction* factor = nullptr;
  std::array<int, kMostBlocks> blocks = {};
  int count = 0;
  const ceres::LossFunction* loss = nullptr;
};

// Blocks that are not eliminated come in the order of their columns, those that all terms may share (the calibration)
// last; terms of an eliminated block stand together.
struct LeastSquares {
  std::vector<ParameterBlock> blocks;
  int first_shared = 0;
  std::vector<ResidualTerm> terms;
  const MarginalPrior* prior = nullptr;
  std::vector<int> prior_blocks;  // of its parts
};

// The eliminated block that a term is of; -1 where there is none.
int eliminated_block(const LeastSquares& problem, const ResidualTerm& term);

// The residuals of a term at the present values, without its loss. False where it cannot be evaluated.
bool evaluate(const LeastSquares& problem, const ResidualTerm& term, double* residuals);

struct LeastSquaresOptions {
  int max_iterations = 50;
  // The last step's length in standard deviations, |delta|_H: what is left is about its square. A damped step that
  // lowers the cost by less than half of that is the last, too.
  double step_tolerance = 1e-2;
  // A step that lowers the cost by less than this share of it is the last, too.
  double cost_tolerance = 0.0;
  // Whether every step is followed by the landmarks' own best values for its poses (variable projection), which
  // `schur` begins with, too.
  bool settle_landmarks = false;
};

struct LeastSquaresResult {
  core::SolveStatus status = core::SolveStatus::kDiverged;
  int iterations = 0;  // linear systems that were solved
  double initial_cost = 0.0;
  double final_cost = 0.0;
};

LeastSquaresResult solve_with_ceres(const LeastSquares& problem, const LeastSquaresOptions& options);

}  // namespace plumbline::estimator
