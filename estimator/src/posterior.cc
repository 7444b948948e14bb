#include "estimator/posterior.h"

#include <Eigen/CholmodSupport>
#include <Eigen/SparseCore>
#include <ceres/crs_matrix.h>

namespace plumbline::estimator {

std::optional<Eigen::MatrixXd> leading_covariance(ceres::Problem& problem, const std::vector<double*>& blocks,
                                                  int leading) {
  ceres::Problem::EvaluateOptions options;
  options.parameter_blocks = blocks;
  options.num_threads = 1;
  ceres::CRSMatrix crs;
  if (!problem.Evaluate(options, nullptr, nullptr, nullptr, &crs)) return std::nullopt;

  using RowMajor = Eigen::SparseMatrix<double, Eigen::RowMajor, int>;
  const Eigen::Map<const RowMajor> J(crs.num_rows, crs.num_cols, static_cast<Eigen::Index>(crs.values.size()),
                                     crs.rows.data(), crs.cols.data(), crs.values.data());
  Eigen::VectorXd scale = Eigen::VectorXd::Zero(crs.num_cols);
  for (std::size_t i = 0; i < crs.values.size(); ++i) scale[crs.cols[i]] += crs.values[i] * crs.values[i];
  if (!(scale.minCoeff() > 0.0)) return std::nullopt;
  scale = scale.cwiseSqrt().cwiseInverse();
  const Eigen::SparseMatrix<double> J_scaled = J * scale.asDiagonal();
  const Eigen::SparseMatrix<double> information = J_scaled.transpose() * J_scaled;

  Eigen::CholmodSupernodalLLT<Eigen::SparseMatrix<double>> solver(information);
  if (solver.info() != Eigen::Success) return std::nullopt;
  const Eigen::MatrixXd columns = solver.solve(Eigen::MatrixXd::Identity(crs.num_cols, leading));
  const auto D = scale.head(leading).asDiagonal();
  const Eigen::MatrixXd covariance = D * columns.topRows(leading) * D;
  if (!covariance.allFinite()) return std::nullopt;
  return Eigen::MatrixXd(0.5 * (covariance + covariance.transpose()));
}

}  // namespace plumbline::estimator
