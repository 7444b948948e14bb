#include "estimator/posterior.h"

#include <Eigen/Core>

namespace plumbline::estimator {

std::optional<core::PosteriorCovariance> posterior_covariance(SchurSystem& system, const EstimateWhat& free) {
  if (!system.solved_undamped() && !(system.build(0.0) && system.solve())) return std::nullopt;
  // L = [ L11 0; L21 L22 ], so that the last rows and columns of (L L^T)^-1 are (L22 L22^T)^-1.
  constexpr int kCalibration = core::kCovLastState;
  const Eigen::MatrixXd L = system.trailing_factor(core::kCovDim);
  const Eigen::MatrixXd inverse =
      L.triangularView<Eigen::Lower>().solve(Eigen::MatrixXd::Identity(core::kCovDim, core::kCovDim));
  const Eigen::MatrixXd P = inverse.transpose() * inverse;
  core::PosteriorCovariance covariance;
  covariance.bottomRightCorner<core::kStateDof, core::kStateDof>() =
      P.topLeftCorner<core::kStateDof, core::kStateDof>();
  covariance.topLeftCorner<kCalibration, kCalibration>() = P.bottomRightCorner<kCalibration, kCalibration>();
  covariance.bottomLeftCorner<core::kStateDof, kCalibration>() = P.topRightCorner<core::kStateDof, kCalibration>();
  covariance.topRightCorner<kCalibration, core::kStateDof>() =
      covariance.bottomLeftCorner<core::kStateDof, kCalibration>().transpose();
  const auto hold = [&](int first, int count, bool is_free) {
    if (is_free) return;
    covariance.middleRows(first, count).setZero();
    covariance.middleCols(first, count).setZero();
  };
  hold(core::kCovExtrinsicPosition, 6, free.extrinsics);
  hold(core::kCovTd, 1, free.td);
  hold(core::kCovReadout, 1, free.readout);
  if (!covariance.allFinite()) return std::nullopt;
  return covariance;
}

}  // namespace plumbline::estimator
