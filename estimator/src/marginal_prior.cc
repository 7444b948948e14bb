#include "estimator/marginal_prior.h"

#include <cmath>

#include <Eigen/Cholesky>

#include "estimator/invariant_chart.h"

namespace plumbline::estimator {

Eigen::VectorXd MarginalPrior::difference(double const* const* parameters) const {
  Eigen::VectorXd xi(gradient.size());
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const Part& part = parts[i];
    const double* x = parameters[i];
    switch (part.kind) {
      case Kind::kState:
        xi.segment<core::kStateDof>(part.column) = invariant_difference(unpack_state(x), unpack_state(part.x0.data()));
        break;
      case Kind::kPose: {
        const core::Pose pose = unpack_pose(x);
        const core::Pose pose0 = unpack_pose(part.x0.data());
        xi.segment<3>(part.column) = pose.p - pose0.p;
        xi.segment<3>(part.column + 3) = core::log_so3(Eigen::Quaterniond(pose0.q.conjugate() * pose.q));
        break;
      }
      case Kind::kNumbers:
        xi.segment(part.column, part.dof()) = Eigen::Map<const Eigen::VectorXd>(x, part.dof()) - part.x0;
        break;
    }
  }
  return xi;
}

// By the Cholesky factorisation with pivoting, which a singular matrix has too, of Lambda scaled to a unit diagonal:
// S Lambda S = P^T L D L^T P.
MarginalPriorFactor::MarginalPriorFactor(const MarginalPrior& prior) : prior_(prior) {
  constexpr double kSingular = 1e-16;
  const auto unit = [](double x) { return x > 0.0 ? std::sqrt(x) : 1.0; };
  const Eigen::VectorXd scale = prior.information.diagonal().unaryExpr(unit);
  const Eigen::VectorXd inverse = scale.cwiseInverse();
  const Eigen::LDLT<Eigen::MatrixXd> ldlt(inverse.asDiagonal() * prior.information * inverse.asDiagonal());
  const Eigen::VectorXd D = ldlt.vectorD();
  const Eigen::VectorXd root = D.unaryExpr([](double d) { return d > kSingular ? std::sqrt(d) : 0.0; });
  const Eigen::MatrixXd L_T = ldlt.matrixU();
  R_ = ldlt.transpositionsP() * Eigen::MatrixXd(scale.asDiagonal());
  R_ = (root.asDiagonal() * L_T * R_).eval();
  r0_ = ldlt.transpositionsP() * inverse.cwiseProduct(prior.gradient);
  ldlt.matrixL().solveInPlace(r0_);
  for (Eigen::Index i = 0; i < D.size(); ++i) r0_[i] = root[i] > 0.0 ? r0_[i] / root[i] : 0.0;
  for (const MarginalPrior::Part& part : prior.parts) {
    mutable_parameter_block_sizes()->push_back(static_cast<int>(part.x0.size()));
  }
  set_num_residuals(static_cast<int>(D.size()));
}

bool MarginalPriorFactor::Evaluate(double const* const* parameters, double* residuals, double** jacobians) const {
  using Kind = MarginalPrior::Kind;
  const Eigen::VectorXd xi = prior_.difference(parameters);
  Eigen::Map<Eigen::VectorXd> r(residuals, num_residuals());
  r = r0_ + R_ * xi;
  if (jacobians == nullptr) return true;
  for (std::size_t i = 0; i < prior_.parts.size(); ++i) {
    if (jacobians[i] == nullptr) continue;
    const MarginalPrior::Part& part = prior_.parts[i];
    using Ambient = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
    Eigen::Map<Ambient> J(jacobians[i], num_residuals(), part.x0.size());
    const auto R = R_.middleCols(part.column, part.dof());
    switch (part.kind) {
      case Kind::kState: {
        const core::State x = unpack_state(parameters[i]);
        const Eigen::MatrixXd tangent = R * invariant_difference_jacobian(x, xi.segment<core::kStateDof>(part.column));
        J.leftCols<3>() = tangent.leftCols<3>();
        J.middleCols<4>(3) = tangent.middleCols<3>(3) * core::minus_jacobian(x.T_W_B.q);
        J.rightCols<9>() = tangent.rightCols<9>();
        break;
      }
      case Kind::kPose: {
        const core::Pose x = unpack_pose(parameters[i]);
        const Eigen::Matrix3d theta = core::right_jacobian_inverse(xi.segment<3>(part.column + 3));
        J.leftCols<3>() = R.leftCols<3>();
        J.rightCols<4>() = R.rightCols<3>() * theta * core::minus_jacobian(x.q);
        break;
      }
      case Kind::kNumbers:
        J = R;
        break;
    }
  }
  return true;
}

}  // namespace plumbline::estimator
