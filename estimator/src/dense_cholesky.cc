#include "estimator/dense_cholesky.h"

extern "C" void dpotrf_(const char* uplo, const int* n, double* a, const int* lda, int* info);

namespace plumbline::estimator {

bool cholesky_in_place(Eigen::MatrixXd& A) {
  const int n = static_cast<int>(A.rows());
  if (n == 0) return true;
  int info = 0;
  dpotrf_("L", &n, A.data(), &n, &info);
  if (info != 0) return false;
  A.triangularView<Eigen::StrictlyUpper>().setZero();
  return true;
}

}  // namespace plumbline::estimator
