// Levenberg and Marquardt on the normal equations.
#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "estimator/landmark_descent.h"
#include "estimator/schur_system.h"

namespace plumbline::estimator {

LeastSquaresResult solve_with_schur(const LeastSquares& problem, const LeastSquaresOptions& options,
                                    SchurSystem& system) {
  constexpr double kFirstDamping = 1e-6;
  constexpr double kLargestDamping = 1e8;
  constexpr double kRounding = 1e-12;  // of a cost
  constexpr double kUndamped = 1e-3;   // up to here a short step means that the minimum is near
  constexpr double kQuartered = 3.0;   // up to here a step that gains next to nothing does: damping is a power of ten
  LeastSquaresResult result;
  result.status = core::SolveStatus::kIterationLimit;
  std::vector<double> before;
  const auto save = [&] {
    before.clear();
    for (const ParameterBlock& b : problem.blocks) before.insert(before.end(), b.values, b.values + b.size);
  };
  const auto restore = [&] {
    const double* from = before.data();
    for (const ParameterBlock& b : problem.blocks) {
      std::copy_n(from, b.size, b.values);
      from += b.size;
    }
  };
  save();
  if (options.settle_landmarks) settle_landmarks(problem, before);
  double damping = 0.0;
  bool built = system.build(damping);
  if (!built) {
    result.status = core::SolveStatus::kDiverged;
    return result;
  }
  result.initial_cost = system.built_cost();
  result.final_cost = system.built_cost();
  save();
  while (result.iterations < options.max_iterations) {
    ++result.iterations;
    // Where the values are those that were saved.
    if (const std::optional<double> length2 = built ? system.solve() : std::nullopt) {
      system.apply_step();
      if (options.settle_landmarks) settle_landmarks(problem, before);
      if (damping <= kUndamped && *length2 <= options.step_tolerance * options.step_tolerance) {
        result.final_cost -= 0.5 * *length2;
        result.status = core::SolveStatus::kConverged;
        return result;
      }
      const double next = damping > kFirstDamping ? 0.1 * damping : 0.0;
      if (system.build(next) && system.built_cost() <= result.final_cost + kRounding * std::abs(result.final_cost)) {
        const double lowered_by = result.final_cost - system.built_cost();
        result.final_cost = system.built_cost();
        const double least_gain = 0.5 * options.step_tolerance * options.step_tolerance;
        if ((damping > kUndamped && damping <= kQuartered && lowered_by <= least_gain) ||
            (options.cost_tolerance > 0.0 && damping <= kUndamped &&
             lowered_by < options.cost_tolerance * result.final_cost)) {
          result.status = core::SolveStatus::kConverged;
          return result;
        }
        damping = next;
        save();
        continue;
      }
      restore();
    }
    damping = std::max(kFirstDamping, 10.0 * damping);
    if (damping > kLargestDamping) {
      result.status = core::SolveStatus::kDiverged;
      return result;
    }
    built = system.build(damping);
  }
  return result;
}

}  // namespace plumbline::estimator
