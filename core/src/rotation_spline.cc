#include "core/rotation_spline.h"

namespace plumbline::core {

void RotationSpline::to(const bspline::Weights& w) {
  lambda_ = w.cumulative[0];
  lambda_dot_ = w.cumulative[1];
  q_ = first_;
  omega_.setZero();
  alpha_.setZero();
  for (int j = 1; j < order_; ++j) {
    const auto i = static_cast<std::size_t>(j);
    A_[i] = exp_quaternion(lambda_[j] * d_[i]);
    q_ = q_ * A_[i];
    w_[i] = A_[i].conjugate() * omega_;
    omega_ = w_[i] + lambda_dot_[j] * d_[i];
    alpha_ = A_[i].conjugate() * alpha_ + lambda_dot_[j] * omega_.cross(d_[i]) + w.cumulative[2][j] * d_[i];
  }
}

}  // namespace plumbline::core
