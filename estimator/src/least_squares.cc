#include "estimator/least_squares.h"

#include <algorithm>
#include <memory>
#include <optional>

#include <ceres/problem.h>
#include <ceres/solver.h>

namespace plumbline::estimator {

LeastSquaresResult solve_with_ceres(const LeastSquares& problem, const LeastSquaresOptions& options) {
  ceres::Problem::Options ownership;
  ownership.cost_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ownership.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ownership.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ownership.disable_all_safety_checks = true;
  ceres::Problem ceres_problem(ownership);
  auto ordering = std::make_shared<ceres::ParameterBlockOrdering>();
  for (const ParameterBlock& block : problem.blocks) {
    ceres_problem.AddParameterBlock(block.values, block.size, const_cast<ceres::Manifold*>(block.manifold));
    if (block.constant) ceres_problem.SetParameterBlockConstant(block.values);
    ordering->AddElementToGroup(block.values, block.eliminated ? 0 : 1);
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
  ceres_options.linear_solver_type = ceres::DENSE_SCHUR;
  ceres_options.dense_linear_algebra_library_type = ceres::LAPACK;
  ceres_options.linear_solver_ordering = ordering;
  ceres_options.num_threads = 1;
  ceres_options.max_num_iterations = options.max_iterations;
  ceres_options.max_solver_time_in_seconds = 1e9;  // never: a result must not depend on the machine's load
  // A step of length s, in standard deviations, lowers the cost by s^2/2.
  ceres_options.function_tolerance = 0.0;
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
