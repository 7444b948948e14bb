#include "estimator/bundle_adjustment.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <deque>
#include <limits>
#include <memory>
#include <vector>

#include <ceres/ordered_groups.h>
#include <ceres/problem.h>
#include <ceres/solver.h>

#include "estimator/factors/bal_factors.h"

namespace plumbline::estimator {
namespace {

BundleSolver choose_solver(BundleSolver wanted, std::size_t cameras) {
  if (wanted != BundleSolver::kAutomatic) return wanted;
  const std::size_t unknowns = kBalCameraSize * cameras;
  if (unknowns <= 3000) return BundleSolver::kDenseSchur;
  return unknowns <= 30000 ? BundleSolver::kSparseSchur : BundleSolver::kIterativeSchur;
}

ceres::LinearSolverType linear_solver(BundleSolver solver) {
  switch (solver) {
    case BundleSolver::kSparseSchur:
      return ceres::SPARSE_SCHUR;
    case BundleSolver::kIterativeSchur:
      return ceres::ITERATIVE_SCHUR;
    default:
      return ceres::DENSE_SCHUR;
  }
}

core::SolveStatus status_of(ceres::TerminationType type) {
  switch (type) {
    case ceres::CONVERGENCE:
      return core::SolveStatus::kConverged;
    case ceres::NO_CONVERGENCE:
      return core::SolveStatus::kIterationLimit;
    default:
      return core::SolveStatus::kDiverged;
  }
}

// Factors and blocks of cameras of one form of the rotation. A deque, since factors cannot be moved.
template <class Factor, class Block>
struct Bundle {
  std::deque<Factor> factors;
  std::vector<Block> cameras;
};

template <class Factor, class Block>
ceres::Solver::Summary solve(core::BalProblem& bal, Bundle<Factor, Block>& bundle, ceres::Manifold* manifold,
                             ceres::Solver::Options options) {
  ceres::Problem::Options problem_options;
  problem_options.cost_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  problem_options.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  problem_options.disable_all_safety_checks = true;  // blocks are whole elements of three vectors
  ceres::Problem problem(problem_options);
  for (const core::BalObservation& o : bal.observations) {
    bundle.factors.emplace_back(o.pixel);
    problem.AddResidualBlock(&bundle.factors.back(), nullptr, bundle.cameras[o.camera].data(),
                             bal.points[o.point].data());
  }
  options.linear_solver_ordering = std::make_shared<ceres::ParameterBlockOrdering>();
  const auto order = [&](double* block, int group) {
    if (problem.HasParameterBlock(block)) options.linear_solver_ordering->AddElementToGroup(block, group);
  };
  for (Eigen::Vector3d& X : bal.points) order(X.data(), 0);
  for (Block& camera : bundle.cameras) {
    order(camera.data(), 1);
    if (manifold != nullptr && problem.HasParameterBlock(camera.data())) {
      problem.SetManifold(camera.data(), manifold);
    }
  }
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  for (std::size_t i = 0; i < bal.cameras.size(); ++i) bal.cameras[i] = unpack_bal_camera(bundle.cameras[i]);
  return summary;
}

ceres::Solver::Summary solve(core::BalProblem& bal, BundleRotation rotation, const ceres::Solver::Options& options) {
  if (rotation == BundleRotation::kAngleAxis) {
    Bundle<BalFactor, BalCameraBlock> bundle;
    for (const core::BalCamera& camera : bal.cameras) bundle.cameras.push_back(pack(camera));
    return solve(bal, bundle, nullptr, options);
  }
  BalLeftCameraManifold manifold;
  Bundle<BalLeftFactor, BalLeftCameraBlock> bundle;
  for (const core::BalCamera& camera : bal.cameras) bundle.cameras.push_back(pack_left(camera));
  return solve(bal, bundle, &manifold, options);
}

int count_behind(const core::BalProblem& bal) {
  return static_cast<int>(std::count_if(bal.observations.begin(), bal.observations.end(), [&](const auto& o) {
    return !core::in_front(bal.cameras[o.camera], core::ViewAxis::kMinusZ, bal.points[o.point]);
  }));
}

}  // namespace

BundleResult adjust_bundle(core::BalProblem problem, const BundleOptions& options) {
  const auto start = std::chrono::steady_clock::now();
  BundleResult result;
  result.solver = choose_solver(options.solver, problem.cameras.size());
  ceres::Solver::Options ceres_options;
  ceres_options.linear_solver_type = linear_solver(result.solver);
  ceres_options.max_num_iterations = options.max_iterations;
  ceres_options.function_tolerance = options.function_tolerance;
  ceres_options.num_threads = options.threads;
  ceres_options.logging_type = ceres::SILENT;
  if (result.solver == BundleSolver::kIterativeSchur) ceres_options.preconditioner_type = ceres::SCHUR_JACOBI;

  const ceres::Solver::Summary summary = solve(problem, options.rotation, ceres_options);
  // Without a first evaluation there is no cost: a point lies in the plane of a camera's centre.
  const bool started = !summary.iterations.empty();
  result.status = started ? status_of(summary.termination_type) : core::SolveStatus::kFailedInitialisation;
  if (result.status != core::SolveStatus::kConverged) result.reason = summary.message;
  result.initial_cost = started ? summary.initial_cost : std::numeric_limits<double>::quiet_NaN();
  result.final_cost = started ? summary.final_cost : std::numeric_limits<double>::quiet_NaN();
  result.iterations = summary.num_successful_steps + summary.num_unsuccessful_steps;
  result.rmse_px = std::sqrt(2.0 * result.final_cost / static_cast<double>(problem.observations.size()));
  result.behind = count_behind(problem);
  result.problem = std::move(problem);
  result.time_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return result;
}

}  // namespace plumbline::estimator
