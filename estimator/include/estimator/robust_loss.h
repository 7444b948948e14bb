// rho of a term, min sum rho(|r|^2)/2; null: none.
#pragma once

#include <memory>

#include <ceres/loss_function.h>

#include "estimator/config.h"

namespace plumbline::estimator {

std::unique_ptr<ceres::LossFunction> make_loss(RobustLoss loss, double scale);

}  // namespace plumbline::estimator
