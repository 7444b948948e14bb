// Writes the derivatives of one end point's residual where Ceres wants them: one row of each row-major Jacobian with
// respect to the ambient spaces of parameter_blocks.h and orthonormal_line.h.
#pragma once

#include <Eigen/Core>

#include "core/so3_manifold.h"
#include "estimator/factors/line_chain.h"
#include "estimator/factors/orthonormal_line.h"
#include "estimator/factors/parameter_blocks.h"

namespace plumbline::estimator {

// The Jacobians of Ceres that are wanted, a row of one of them at a time.
class LineRows {
 public:
  explicit LineRows(double** jacobians) : jacobians_(jacobians) {}

  bool any() const { return jacobians_ != nullptr; }
  double* row(int block, int size, int k) const {
    double* J = any() ? jacobians_[block] : nullptr;
    return J != nullptr ? J + static_cast<std::ptrdiff_t>(k) * size : nullptr;
  }

 private:
  double** jacobians_;
};

inline void write_pose_row(const Eigen::Vector3d& position, const Eigen::Vector3d& rotation,
                           const Eigen::Quaterniond& q, double* out) {
  if (out == nullptr) return;
  Eigen::Map<Eigen::Matrix<double, 1, kPoseSize>> row(out);
  row.head<3>() = position.transpose();
  row.tail<4>() = rotation.transpose() * core::minus_jacobian(q);
}

inline void write_line_row(const OrthonormalLine& line, const LineChain& chain, const LineGradient& gradient,
                           double* out) {
  if (out != nullptr) line.write_row(line.to_tangent(gradient.line_n(), gradient.line_d(chain)), out);
}

inline void write_scalar(double value, double* out) {
  if (out != nullptr) *out = value;
}

}  // namespace plumbline::estimator
