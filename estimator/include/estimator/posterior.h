// Marginal covariance of a least-squares problem: the leading block of (J^T J)^-1 at the present values, J the
// whitened Jacobian on the tangent spaces, weighted by the loss functions where there are any.
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>
#include <ceres/problem.h>

namespace plumbline::estimator {

// Of the first `leading` columns of J in the order of `blocks`, which are all free blocks of the problem. By sparse
// Cholesky of the information, scaled to unit diagonal, with as many back-substitutions as columns asked for. Nothing
// where the information is singular.
std::optional<Eigen::MatrixXd> leading_covariance(ceres::Problem& problem, const std::vector<double*>& blocks,
                                                  int leading);

}  // namespace plumbline::estimator
