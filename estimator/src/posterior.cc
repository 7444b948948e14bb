#include "estimator/posterior.h"

#include <vector>

#include <Eigen/Core>

namespace plumbline::estimator {

std::optional<core::PosteriorCovariance> posterior_covariance(SchurSystem& system, const EstimateWhat& free,
                                                              const Eigen::MatrixXd& newest) {
  if (!system.solved_undamped() && !(system.build(0.0) && system.solve())) return std::nullopt;
  // L = [ L11 0; L21 L22 ], so that the last rows and columns of (L L^T)^-1 are (L22 L22^T)^-1.
  std::vector<int> rows;  // of the covariance
  const auto add_rows = [&](int first, int count) {
    for (int i = 0; i < count; ++i) rows.push_back(first + i);
  };
  add_rows(core::kCovLastState, core::kStateDof);
  add_rows(0, core::kCovLastState);
  if (free.intrinsics) add_rows(core::kCovIntrinsics, core::kCovDim - core::kCovIntrinsics);
  const int calibration = calibration_columns(free);
  const auto state = static_cast<int>(newest.cols());
  Eigen::MatrixXd half = Eigen::MatrixXd::Zero(state + calibration, core::kStateDof + calibration);
  half.topLeftCorner(state, core::kStateDof) = newest.transpose();
  half.bottomRightCorner(calibration, calibration).setIdentity();
  system.trailing_factor(state + calibration).triangularView<Eigen::Lower>().solveInPlace(half);
  core::PosteriorCovariance covariance = core::PosteriorCovariance::Zero();
  covariance(rows, rows) = half.transpose() * half;
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
