// Normalised estimation error squared:   nees = e^T P^-1 e,
// chi-square distributed with dim(e) degrees of freedom where e ~ N(0, P). e is the estimator's own perturbation
// (core/state.h), before any alignment, and P its covariance; Bar-Shalom, Li, Kirubarajan, 2001, section 5.4.
#pragma once

#include <optional>

#include <Eigen/Core>

namespace plumbline::eval {

// Nothing where P is not finite, symmetric and positive definite. That is judged on its correlations, since a block
// may hold metres beside radians: their smallest eigenvalue must exceed 1e-13.
std::optional<double> nees(const Eigen::VectorXd& e, const Eigen::MatrixXd& P);

}  // namespace plumbline::eval
