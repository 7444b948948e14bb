// Where the search ends.
#include <cmath>

#include <ceres/sized_cost_function.h>
#include <gtest/gtest.h>

#include "estimator/schur_system.h"

namespace plumbline::estimator {
namespace {

// r = (x + 1, c x^2 + x - 1), least at x = 0. There J^T J = 2 and the second derivative of the cost is 2 - 2c: a Gauss
// and Newton step goes to c x, so that with c < -1 only damped ones come nearer. (Dennis and Schnabel, "Numerical
// methods for unconstrained optimization and nonlinear equations", example 10.2.4.)
class LargeResidual final : public ceres::SizedCostFunction<2, 1> {
 public:
  explicit LargeResidual(double curvature) : c_(curvature) {}
  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    const double x = *parameters[0];
    residuals[0] = x + 1.0;
    residuals[1] = c_ * x * x + x - 1.0;
    if (jacobians != nullptr && jacobians[0] != nullptr) {
      jacobians[0][0] = 1.0;
      jacobians[0][1] = 2.0 * c_ * x + 1.0;
    }
    return true;
  }

 private:
  double c_;
};

struct Minimum {
  double x = 0.5;
  LeastSquaresResult result;
};
Minimum minimise(double curvature, int most_iterations) {
  Minimum found;
  const LargeResidual factor(curvature);
  LeastSquares problem;
  problem.blocks.push_back({.values = &found.x, .size = 1, .dof = 1});
  problem.terms.push_back({.factor = &factor, .blocks = {0}, .count = 1});
  SchurSystem system(problem);
  found.result = solve_with_schur(problem, {.max_iterations = most_iterations}, system);
  return found;
}

TEST(SolveWithSchur, StopsAtAShortStep) {
  const Minimum found = minimise(0.1, 10);
  EXPECT_EQ(found.result.status, core::SolveStatus::kConverged);
  EXPECT_LT(std::abs(found.x), 1e-2);
}

// Every second step, of damping 1, takes x to a quarter and gains 2.5 x^2: half of the tolerance's square, 5e-5, from x
// = 0.0046 on, after 20 iterations. Undamped steps are refused until the gain drowns in the cost's rounding, after 32.
TEST(SolveWithSchur, StopsWhereDampedStepsGainNothing) {
  const Minimum found = minimise(-1.5, 22);
  EXPECT_EQ(found.result.status, core::SolveStatus::kConverged);
  EXPECT_LT(std::abs(found.x), 1e-2);
  EXPECT_EQ(minimise(-1.5, 4).result.status, core::SolveStatus::kIterationLimit);
}

}  // namespace
}  // namespace plumbline::estimator
