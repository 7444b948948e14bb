// What the laws of factor_laws.h are made of: evaluation of a factor on its blocks, Jacobians on the tangent spaces,
// and their comparison with differences and with another factor.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include <Eigen/Core>
#include <ceres/cost_function.h>
#include <ceres/manifold.h>
#include <gtest/gtest.h>

#include "core/random.h"

namespace plumbline::testing {

struct Block {
  std::vector<double> values;
  const ceres::Manifold* manifold = nullptr;  // Euclidean where null
  double ridders_step = 1e-3;                 // first step of the differences, in units of the tangent

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
Block block(const Vector& x, const ceres::Manifold* manifold = nullptr, double ridders_step = 1e-3) {
  return {std::vector<double>(x.data(), x.data() + x.size()), manifold, ridders_step};
}
inline Block scalar_block(double x, double ridders_step = 1e-3) { return {{x}, nullptr, ridders_step}; }

// Moves a block along its manifold, by standard normal numbers times the scale.
inline void displace(Block& b, double scale, const core::RandomStream& random, std::uint64_t index, std::uint64_t sub) {
  Eigen::VectorXd delta(b.tangent_size());
  for (int i = 0; i < delta.size(); ++i) {
    delta[i] = scale * random.normal(index, 100 * sub + static_cast<std::uint64_t>(i));
  }
  b.values = b.plus(delta);
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

using RowMajorMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// Residual and Jacobians with respect to the ambient spaces of the blocks that are wanted.
struct Evaluation {
  Eigen::VectorXd residual;
  std::vector<RowMajorMatrix> jacobians;
};
inline Evaluation evaluate(const ceres::CostFunction& factor, const std::vector<Block>& blocks,
                           const std::vector<bool>& wanted) {
  Evaluation e{Eigen::VectorXd(factor.num_residuals()), {}};
  std::vector<double*> jacobians;
  for (const Block& block : blocks) {
    // What a factor forgets to write stays NaN.
    e.jacobians.emplace_back(RowMajorMatrix::Constant(factor.num_residuals(), static_cast<int>(block.values.size()),
                                                      std::numeric_limits<double>::quiet_NaN()));
  }
  for (std::size_t k = 0; k < blocks.size(); ++k) jacobians.push_back(wanted[k] ? e.jacobians[k].data() : nullptr);
  EXPECT_TRUE(factor.Evaluate(pointers(blocks).data(), e.residual.data(), jacobians.data()));
  return e;
}

inline Eigen::MatrixXd on_tangent(const RowMajorMatrix& ambient, const Block& b) {
  if (b.manifold == nullptr) return ambient;
  RowMajorMatrix plus(static_cast<int>(b.values.size()), b.tangent_size());
  EXPECT_TRUE(b.manifold->PlusJacobian(b.values.data(), plus.data()));
  return ambient * plus;
}

// The analytic Jacobian of block k on its tangent space; the other blocks are constant.
inline Eigen::MatrixXd tangent_jacobian(const ceres::CostFunction& factor, const std::vector<Block>& blocks,
                                        std::size_t k) {
  std::vector<bool> wanted(blocks.size(), false);
  wanted[k] = true;
  return on_tangent(evaluate(factor, blocks, wanted).jacobians[k], blocks[k]);
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

// Relative to the largest entry, or to `floor`: whitened entries span many orders, and what is small is judged against
// what matters.
inline void expect_near(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b, double tolerance, std::size_t k,
                        double floor = 1e-12) {
  const double scale = std::max(b.cwiseAbs().maxCoeff(), floor);
  const double difference = (a - b).cwiseAbs().maxCoeff() / scale;
  EXPECT_TRUE(difference <= tolerance) << "block " << k << ", relative difference " << difference << "\nanalytic\n"
                                       << a << "\nexpected\n"
                                       << b;
}

inline void expect_jacobian(const ceres::CostFunction& factor, const std::vector<Block>& blocks, std::size_t k,
                            double first_step, double tolerance, double floor = 1e-12) {
  expect_near(tangent_jacobian(factor, blocks, k), ridders_jacobian(factor, blocks, k, first_step), tolerance, k,
              floor);
}

// Residuals and Jacobians of two factors on the same blocks.
inline void expect_equal_factors(const ceres::CostFunction& factor, const ceres::CostFunction& reference,
                                 const std::vector<Block>& blocks, double tolerance) {
  const std::vector<bool> all(blocks.size(), true);
  const Evaluation a = evaluate(factor, blocks, all);
  const Evaluation b = evaluate(reference, blocks, all);
  EXPECT_LT((a.residual - b.residual).norm(), tolerance * std::max(1.0, b.residual.norm()))
      << "residual\n"
      << a.residual.transpose() << "\nexpected\n"
      << b.residual.transpose();
  // A block that vanishes, such as the extrinsics' without motion, is rounding of the others.
  double largest = 0.0;
  for (const RowMajorMatrix& J : b.jacobians) largest = std::max(largest, J.cwiseAbs().maxCoeff());
  for (std::size_t k = 0; k < blocks.size(); ++k) {
    expect_near(on_tangent(a.jacobians[k], blocks[k]), on_tangent(b.jacobians[k], blocks[k]), tolerance, k,
                1e-5 * largest);
  }
}

}  // namespace plumbline::testing
