// Laws that every factor obeys, as checks that a test calls with a factor and its parameter blocks.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include <Eigen/Core>
#include <ceres/cost_function.h>
#include <ceres/manifold.h>
#include <gtest/gtest.h>

namespace plumbline::testing {

struct Block {
  std::vector<double> values;
  const ceres::Manifold* manifold = nullptr;  // Euclidean where null

  int tangent_size() const { return manifold != nullptr ? manifold->TangentSize() : static_cast<int>(values.size()); }
  std::vector<double> plus(const Eigen::VectorXd& delta) const {
    std::vector<double> moved(values.size());
    if (manifold != nullptr) {
      manifold->Plus(values.data(), delta.data(), moved.data());
    } else {
      for (std::size_t i = 0; i < values.size(); ++i) moved[i] = values[i] + delta[static_cast<int>(i)];
    }
    return moved;
  }
};

template <class Vector>
Block block(const Vector& x, const ceres::Manifold* manifold = nullptr) {
  return {std::vector<double>(x.data(), x.data() + x.size()), manifold};
}

inline std::vector<const double*> pointers(const std::vector<Block>& blocks) {
  std::vector<const double*> p;
  for (const Block& b : blocks) p.push_back(b.values.data());
  return p;
}

inline Eigen::VectorXd residual(const ceres::CostFunction& factor, const std::vector<Block>& blocks) {
  Eigen::VectorXd r(factor.num_residuals());
  EXPECT_TRUE(factor.Evaluate(pointers(blocks).data(), r.data(), nullptr));
  return r;
}

// The analytic Jacobian of block k on its tangent space.
inline Eigen::MatrixXd tangent_jacobian(const ceres::CostFunction& factor, const std::vector<Block>& blocks,
                                        std::size_t k) {
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  const Block& b = blocks[k];
  RowMajor ambient(factor.num_residuals(), static_cast<int>(b.values.size()));
  std::vector<double*> jacobians(blocks.size(), nullptr);  // the other blocks are constant: the null-Jacobian path
  jacobians[k] = ambient.data();
  Eigen::VectorXd r(factor.num_residuals());
  EXPECT_TRUE(factor.Evaluate(pointers(blocks).data(), r.data(), jacobians.data()));
  if (b.manifold == nullptr) return ambient;
  RowMajor plus(static_cast<int>(b.values.size()), b.tangent_size());
  EXPECT_TRUE(b.manifold->PlusJacobian(b.values.data(), plus.data()));
  return ambient * plus;
}

// By Ridders' method: central differences of shrinking step, extrapolated to step 0, the best by its own error
// estimate. Knows the residual only.
inline Eigen::MatrixXd ridders_jacobian(const ceres::CostFunction& factor, const std::vector<Block>& blocks,
                                        std::size_t k, double first_step) {
  constexpr int kSteps = 8;
  constexpr double kShrink = 2.0;
  const int n = blocks[k].tangent_size();
  Eigen::MatrixXd J(factor.num_residuals(), n);
  for (int c = 0; c < n; ++c) {
    const auto difference = [&](double h) -> Eigen::VectorXd {
      Eigen::VectorXd delta = Eigen::VectorXd::Zero(n);
      std::vector<Block> moved = blocks;
      delta[c] = h;
      moved[k].values = blocks[k].plus(delta);
      const Eigen::VectorXd forward = residual(factor, moved);
      delta[c] = -h;
      moved[k].values = blocks[k].plus(delta);
      return (forward - residual(factor, moved)) / (2.0 * h);
    };
    std::vector<std::vector<Eigen::VectorXd>> table(kSteps);
    double best_error = std::numeric_limits<double>::infinity();
    double h = first_step;
    for (std::size_t i = 0; i < kSteps; ++i, h /= kShrink) {
      table[i].push_back(difference(h));
      double factor2 = kShrink * kShrink;
      for (std::size_t j = 1; j <= i; ++j, factor2 *= kShrink * kShrink) {
        table[i].push_back((factor2 * table[i][j - 1] - table[i - 1][j - 1]) / (factor2 - 1.0));
        const double error =
            std::max((table[i][j] - table[i][j - 1]).norm(), (table[i][j] - table[i - 1][j - 1]).norm());
        if (error < best_error) {
          best_error = error;
          J.col(c) = table[i][j];
        }
      }
    }
  }
  return J;
}

// `first_step` in the units of the block's tangent; the tolerance is relative to the largest entry of the block.
inline void expect_jacobian(const ceres::CostFunction& factor, const std::vector<Block>& blocks, std::size_t k,
                            double first_step, double tolerance) {
  const Eigen::MatrixXd analytic = tangent_jacobian(factor, blocks, k);
  const Eigen::MatrixXd numeric = ridders_jacobian(factor, blocks, k, first_step);
  const double scale = std::max(numeric.cwiseAbs().maxCoeff(), 1e-12);
  EXPECT_LT((analytic - numeric).cwiseAbs().maxCoeff() / scale, tolerance) << "block " << k << "\nanalytic\n"
                                                                           << analytic << "\nnumeric\n"
                                                                           << numeric;
}

}  // namespace plumbline::testing
