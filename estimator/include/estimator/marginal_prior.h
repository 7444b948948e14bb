// What measurements that have left the window say of what is still in it, about the linearisation point x0:
//   cost(x) = xi^T Lambda xi/2 + eta^T xi,   xi the difference of x from x0
// of states that of invariant_chart.h, of a pose [ p - p0 | Log(q0^-1 q) ], of numbers and landmarks the plain one. The
// cost counts from x0, and Lambda may be singular: what anchors a landmark anew is in it without being measured.
//
// In a solve xi has its exact derivative. Where the prior is folded into the next one, Lambda itself stands for it: xi
// then counts from the new linearisation point, and the derivative of one difference with respect to the other is the
// identity but for terms of the order of xi, whose rows would no longer be blind to the four unobservable directions.
#pragma once

#include <vector>

#include <Eigen/Core>
#include <ceres/cost_function.h>

#include "estimator/factors/parameter_blocks.h"
#include "estimator/factors/preintegration.h"

namespace plumbline::estimator {

struct MarginalPrior {
  enum class Kind { kState, kPose, kNumbers };
  struct Part {
    Kind kind = Kind::kNumbers;
    int column = 0;
    Eigen::VectorXd x0 = {};  // as in the parameter block

    int dof() const { return static_cast<int>(x0.size()) - (kind == Kind::kNumbers ? 0 : 1); }
  };

  std::vector<Part> parts;
  Eigen::MatrixXd information;  // Lambda, symmetric, whole
  Eigen::VectorXd gradient;     // eta

  Eigen::VectorXd difference(double const* const* parameters) const;
  Eigen::VectorXd gradient_at(const Eigen::VectorXd& xi) const { return information * xi + gradient; }
  double cost(const Eigen::VectorXd& xi) const { return xi.dot(0.5 * (information * xi) + gradient); }
};

// The same as a residual, r = r0 + R xi with Lambda = R^T R and eta = R^T r0; its cost counts from |r0|^2/2 less.
class MarginalPriorFactor final : public ceres::CostFunction {
 public:
  explicit MarginalPriorFactor(const MarginalPrior& prior);

  double cost_at_zero() const { return 0.5 * r0_.squaredNorm(); }
  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override;

 private:
  const MarginalPrior& prior_;
  Eigen::MatrixXd R_;
  Eigen::VectorXd r0_;
};

}  // namespace plumbline::estimator
