#include "eval/nees.h"

#include <cmath>

#include <Eigen/Eigenvalues>

namespace plumbline::eval {

std::optional<double> nees(const Eigen::VectorXd& e, const Eigen::MatrixXd& P) {
  constexpr double kMinEigenvalue = 1e-13;
  constexpr double kMaxAsymmetry = 1e-6;
  if (!e.allFinite() || !P.allFinite() || !(P.diagonal().minCoeff() > 0.0)) return std::nullopt;
  const Eigen::VectorXd scale = P.diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd correlation = scale.asDiagonal() * P * scale.asDiagonal();
  if (!correlation.allFinite() || (correlation - correlation.transpose()).cwiseAbs().maxCoeff() > kMaxAsymmetry) {
    return std::nullopt;
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(correlation);
  if (solver.info() != Eigen::Success || !(solver.eigenvalues().minCoeff() > kMinEigenvalue)) return std::nullopt;
  const Eigen::VectorXd whitened = solver.eigenvalues().cwiseSqrt().cwiseInverse().asDiagonal() *
                                   solver.eigenvectors().transpose() * scale.cwiseProduct(e);
  const double value = whitened.squaredNorm();
  return std::isfinite(value) ? std::optional(value) : std::nullopt;
}

}  // namespace plumbline::eval
