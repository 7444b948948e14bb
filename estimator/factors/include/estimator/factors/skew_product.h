// m [v]x for m of any number of rows, column by column: what a chain of Jacobians meets at each rotation.
#pragma once

#include <Eigen/Core>

namespace plumbline::estimator {

template <class Derived>
Eigen::Matrix<double, Derived::RowsAtCompileTime, 3> times_skew(const Eigen::MatrixBase<Derived>& m,
                                                                const Eigen::Vector3d& v) {
  const Eigen::Matrix<double, Derived::RowsAtCompileTime, 3> rows = m;
  Eigen::Matrix<double, Derived::RowsAtCompileTime, 3> result;
  result.col(0) = v.z() * rows.col(1) - v.y() * rows.col(2);
  result.col(1) = v.x() * rows.col(2) - v.z() * rows.col(0);
  result.col(2) = v.y() * rows.col(0) - v.x() * rows.col(1);
  return result;
}

}  // namespace plumbline::estimator
