// Marginal covariance of calibration and newest state: their block of the inverse information at the present values,
// landmarks and earlier states taken out.
#pragma once

#include <optional>

#include <Eigen/Core>

#include "core/estimate.h"
#include "estimator/config.h"
#include "estimator/schur_system.h"

namespace plumbline::estimator {

// Of a system whose last columns are the calibration's and, before them, those that the newest state depends on with
// the derivatives `newest` (its own, where it is a block). Built and solved anew unless its last solve was undamped,
// for then all but the last, short step is in it. What is held has zeros. Nothing where the information is singular.
std::optional<core::PosteriorCovariance> posterior_covariance(
    SchurSystem& system, const EstimateWhat& free,
    const Eigen::MatrixXd& newest = Eigen::MatrixXd::Identity(core::kStateDof, core::kStateDof));

// The columns of the calibration.
inline int calibration_columns(const EstimateWhat& free) {
  return core::kCovLastState + (free.intrinsics ? core::kCovDim - core::kCovIntrinsics : 0);
}

}  // namespace plumbline::estimator
