// The Cholesky factor of a matrix with an envelope and a border, held to Eigen's of the same matrix written out in
// full.
#include "estimator/bordered_band.h"

#include <vector>

#include <Eigen/Cholesky>
#include <gtest/gtest.h>

#include "core/random.h"
#include "estimator/outer_products.h"

namespace plumbline {
namespace {

using estimator::BorderedBand;

const core::RandomStream kRandom({11, 0}, "bordered_band_test");

// 200 unknowns in blocks of 10, each of which meets the next one to five, and a border of 3.
struct Example {
  static constexpr int kBanded = 200;
  static constexpr int kBlock = 10;
  static constexpr int kBorder = 3;
  std::vector<int> reach;
  Eigen::MatrixXd A;
  BorderedBand band;

  explicit Example(double diagonal) : A(Eigen::MatrixXd::Zero(kBanded + kBorder, kBanded + kBorder)) {
    std::uint64_t draw = 0;
    for (int j = 0; j < kBanded; ++j) {
      const int block = j / kBlock;
      reach.push_back(std::min(kBanded, (block + 2 + block % 5) * kBlock));
      for (int i = j; i < kBanded + kBorder; ++i) {
        if (i < reach.back() || i >= kBanded) A(i, j) = kRandom.normal(0, draw++);
      }
    }
    A.bottomRightCorner(kBorder, kBorder).setIdentity();
    A.diagonal().array() += diagonal;
    band = BorderedBand(reach, kBorder);
    band.set_zero();
    for (int j = 0; j < A.cols(); ++j) {
      for (int i = j; i < A.rows(); ++i) {
        if (A(i, j) != 0.0) *band.at(i, j) = A(i, j);
      }
    }
    A = Eigen::MatrixXd(A.selfadjointView<Eigen::Lower>());
  }
};

TEST(BorderedBand, FactorsAndSolves) {
  Example example(60.0);
  const Eigen::MatrixXd& A = example.A;
  EXPECT_TRUE(example.band.dense().isApprox(Eigen::MatrixXd(A.triangularView<Eigen::Lower>()), 0.0));
  ASSERT_TRUE(example.band.factor());
  const Eigen::LLT<Eigen::MatrixXd> llt(A);
  const Eigen::MatrixXd L = llt.matrixL();
  EXPECT_TRUE(example.band.dense().isApprox(L, 1e-12));
  EXPECT_TRUE(example.band.trailing(12).isApprox(L.bottomRightCorner(12, 12), 1e-12));
  const Eigen::VectorXd b = Eigen::VectorXd::LinSpaced(A.rows(), -1.0, 1.0);
  Eigen::VectorXd x = b;
  example.band.solve_lower(x);
  EXPECT_NEAR(x.squaredNorm(), b.dot(llt.solve(b)), 1e-12 * x.squaredNorm());
  example.band.solve_upper(x);
  EXPECT_TRUE(x.isApprox(llt.solve(b), 1e-12));
}

TEST(BorderedBand, SaysWhereItIsNotPositiveDefinite) {
  EXPECT_FALSE(Example(-1.0).band.factor());
  Example border(60.0);
  *border.band.at(border.kBanded + 1, border.kBanded + 1) = -1e3;
  EXPECT_FALSE(border.band.factor());
}

// What is written above the diagonal of a block on it, as blocks are, changes nothing.
TEST(BorderedBand, NothingAboveTheDiagonalCounts) {
  Example clean(60.0);
  Example soiled(60.0);
  for (int j = 0; j < clean.kBanded; j += clean.kBlock) {
    auto block = soiled.band.block(j, j, clean.kBlock, clean.kBlock);
    block.triangularView<Eigen::StrictlyUpper>().setConstant(1e9);
  }
  ASSERT_TRUE(clean.band.factor());
  ASSERT_TRUE(soiled.band.factor());
  EXPECT_EQ(clean.band.dense(), soiled.band.dense());
}

TEST(OuterProducts, AreThose) {
  for (int rows = 1; rows <= 9; ++rows) {
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> A(rows, 7);
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> B(rows, 11);
    for (int i = 0; i < A.size(); ++i) A.data()[i] = kRandom.normal(1, static_cast<std::uint64_t>(i));
    for (int i = 0; i < B.size(); ++i) B.data()[i] = kRandom.normal(2, static_cast<std::uint64_t>(i));
    Eigen::MatrixXd C = Eigen::MatrixXd::Ones(5, 6);
    estimator::add_outer_products({A.data() + 1, rows, 7, 5}, {B.data() + 2, rows, 11, 6}, -1.0, C.data(), 5);
    const Eigen::MatrixXd expected = Eigen::MatrixXd::Ones(5, 6) - A.middleCols(1, 5).transpose() * B.middleCols(2, 6);
    EXPECT_TRUE(C.isApprox(expected, 1e-14)) << rows;
    Eigen::MatrixXd D = Eigen::MatrixXd::Zero(5, 5);
    estimator::add_outer_products({A.data(), rows, 7, 5}, {A.data(), rows, 7, 5}, 1.0, D.data(), 5, true);
    const Eigen::MatrixXd lower =
        Eigen::MatrixXd(A.leftCols(5).transpose() * A.leftCols(5)).triangularView<Eigen::Lower>();
    EXPECT_TRUE(D.isApprox(lower, 1e-14)) << rows;
  }
}

}  // namespace
}  // namespace plumbline
