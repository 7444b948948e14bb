// Marginal covariance of calibration and newest state: their block of the inverse information at the present values,
// landmarks and earlier states taken out.
#pragma once

#include <optional>

#include "core/estimate.h"
#include "estimator/config.h"
#include "estimator/schur_system.h"

namespace plumbline::estimator {

// Of a system whose last columns are the newest state's and then the calibration's; built and solved anew unless its
// last solve was undamped, for then all but the last, short step is in it. What is held has zeros. Nothing where the
// information is singular.
std::optional<core::PosteriorCovariance> posterior_covariance(SchurSystem& system, const EstimateWhat& free);

}  // namespace plumbline::estimator
