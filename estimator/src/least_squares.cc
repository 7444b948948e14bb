#include "estimator/least_squares.h"

#include <algorithm>
#include <memory>
#include <optional>

#include <ceres/problem.h>
#include <ceres/solver.h>

namespace plumbline::estimator {

int eliminated_block(const LeastSquares& problem, const ResidualTerm& term) {
  for (int b = 0; b < term.count; ++b) {
    const int block = term.blocks[static_cast<std::size_t>(b)];
    if (problem.blocks[static_cast<std::size_t>(block)].eliminated) return block;
  }
  return -1;
}

bool evaluate(const LeastSquares& problem, const ResidualTerm& term, double* residuals) {
  std::array<const double*, kMostBlocks> parameters = {};
  for (std::size_t b = 0; b < static_cast<std::size_t>(term.count); ++b) {
    parameters[b] = problem.blocks[static_cast<std::size_t>(term.blocks[b])].values;
  }
  return term.factor->Evaluate(parameters.data(), residuals, nullptr);
}

LeastSquaresResult solve_with_ceres(const LeastSquares& problem, const LeastSquaresOptions& options) {
  ceres::Problem::Options ownership;
  ownership.cost_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ownership.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ownership.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ownership.disable_all_safety_checks = true;
  ceres::Problem ceres_problem(ownership);
  auto ordering = std::make_shared<ceres::ParameterBlockOrdering>();
  auto landmarks = std::make_shared<ceres::ParameterBlockOrdering>();
  int columns = 0;  // that are not eliminated
  for (const ParameterBlock& block : problem.blocks) {
    ceres_problem.AddParameterBlock(block.values, block.size, const_cast<ceres::Manifold*>(block.manifold));
    if (block.constant) ceres_problem.SetParameterBlockConstant(block.values);
    ordering->AddElementToGroup(block.values, block.eliminated ? 0 : 1);
    if (block.eliminated) {
      landmarks->AddElementToGroup(block.values, 0);
    } else {
      columns += block.dof;
    }
  }
  const auto values = [&](int block) { return problem.blocks[static_cast<std::size_t>(block)].values; };
  std::vector<double*> parameters;
  for (const ResidualTerm& term : problem.terms) {
    parameters.clear();
    for (int b = 0; b < term.count; ++b) parameters.push_back(values(term.blocks[static_cast<std::size_t>(b)]));
    ceres_problem.AddResidualBlock(const_cast<ceres::CostFunction*>(term.factor),
                                   const_cast<ceres::LossFunction*>(term.loss), parameters);
  }
  std::optional<MarginalPriorFactor> prior;
  if (problem.prior != nullptr) {
    prior.emplace(*problem.prior);
    parameters.clear();
    for (const int b : problem.prior_blocks) parameters.push_back(values(b));
    ceres_problem.AddResidualBlock(&*prior, nullptr, parameters);
  }
  const double cost_from = prior ? prior->cost_at_zero() : 0.0;

  ceres::Solver::Options ceres_options;
  // Tracks of seconds leave few zeros between the states of a short recording, and dense Cholesky has less to keep
  // books of.
  constexpr int kDenseUpTo = 3000;
  ceres_options.linear_solver_type = columns <= kDenseUpTo ? ceres::DENSE_SCHUR : ceres::SPARSE_SCHUR;
  ceres_options.dense_linear_algebra_library_type = ceres::LAPACK;
  ceres_options.sparse_linear_algebra_library_type = ceres::SUITE_SPARSE;
  ceres_options.use_inner_iterations = options.settle_landmarks && landmarks->NumElements() > 0;
  ceres_options.inner_iteration_ordering = landmarks;
  ceres_options.linear_solver_ordering = ordering;
  ceres_options.num_threads = 1;
  ceres_options.max_num_iterations = options.max_iterations;
  ceres_options.max_solver_time_in_seconds = 1e9;  // never: a result must not depend on the machine's load
  // A step of length s, in standard deviations, lowers the cost by s^2/2.
  ceres_options.function_tolerance = options.cost_tolerance;
  ceres_options.gradient_tolerance = 0.0;
  ceres_options.parameter_tolerance = 0.0;
  ceres_options.initial_trust_region_radius = 1e12;
  ceres_options.logging_type = ceres::SILENT;
  class StopAtStep final : public ceres::IterationCallback {
   public:
    explicit StopAtStep(double least_decrease) : least_decrease_(least_decrease) {}
    ceres::CallbackReturnType operator()(const ceres::IterationSummary& summary) override {
      if (summary.iteration == 0 || !summary.step_is_successful) return ceres::SOLVER_CONTINUE;
      return summary.cost_change <= least_decrease_ ? ceres::SOLVER_TERMINATE_SUCCESSFULLY : ceres::SOLVER_CONTINUE;
    }

   private:
    double least_decrease_;
  };
  StopAtStep stop(0.5 * options.step_tolerance * options.step_tolerance);
  ceres_options.callbacks = {&stop};

  ceres::Solver::Summary summary;
  ceres::Solve(ceres_options, &ceres_problem, &summary);
  LeastSquaresResult result{.iterations = std::max(0, static_cast<int>(summary.iterations.size()) - 1),
                            .initial_cost = summary.initial_cost - cost_from,
                            .final_cost = summary.final_cost - cost_from};
  switch (summary.termination_type) {
    case ceres::CONVERGENCE:
    case ceres::USER_SUCCESS:
      result.status = core::SolveStatus::kConverged;
      break;
    case ceres::NO_CONVERGENCE:
      result.status = core::SolveStatus::kIterationLimit;
      break;
    default:
      result.status = core::SolveStatus::kDiverged;
  }
  return result;
}

}  // namespace plumbline::estimator
