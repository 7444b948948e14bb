// Cholesky factorisation of a dense matrix by LAPACK, which the BLAS in use makes faster than Eigen's own.
#pragma once

#include <Eigen/Core>

namespace plumbline::estimator {

// A = L L^T: the lower triangle of A becomes L, the strict upper one zero. False where A is not positive definite.
bool cholesky_in_place(Eigen::MatrixXd& A);

}  // namespace plumbline::estimator
