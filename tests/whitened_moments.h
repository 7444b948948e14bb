// First and second moments of whitened residuals of two rows, which are independent and standard normal.
#pragma once

#include <cmath>

#include <Eigen/Core>
#include <gtest/gtest.h>

namespace plumbline::testing {

struct WhitenedMoments {
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  Eigen::Matrix2d squares = Eigen::Matrix2d::Zero();
  int n = 0;

  void add(const Eigen::Vector2d& r) {
    sum += r;
    squares += r * r.transpose();
    ++n;
  }

  // 4.5 sigma of the mean and of the second moments.
  void expect_standard_normal() const {
    const double root_n = std::sqrt(n);
    for (int i = 0; i < 2; ++i) {
      EXPECT_LT(std::abs(sum[i]) / n, 4.5 / root_n);
      EXPECT_NEAR(squares(i, i) / n, 1.0, 4.5 * std::sqrt(2.0) / root_n);
    }
    EXPECT_LT(std::abs(squares(0, 1)) / n, 4.5 / root_n);
  }
};

}  // namespace plumbline::testing
