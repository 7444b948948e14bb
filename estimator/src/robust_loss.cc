#include "estimator/robust_loss.h"

#include <stdexcept>

namespace plumbline::estimator {

std::unique_ptr<ceres::LossFunction> make_loss(RobustLoss loss, double scale) {
  switch (loss) {
    case RobustLoss::kNone:
      return nullptr;
    case RobustLoss::kHuber:
      return std::make_unique<ceres::HuberLoss>(scale);
    case RobustLoss::kCauchy:
      return std::make_unique<ceres::CauchyLoss>(scale);
  }
  throw std::logic_error("make_loss: unknown loss");
}

}  // namespace plumbline::estimator
