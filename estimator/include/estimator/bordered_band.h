// Lower triangle of a symmetric positive definite matrix with an envelope and a full border,
//   [ B  C^T ]
//   [ C  D   ],
// where row i of B is zero left of the columns that reach it, and its Cholesky factor, which fills nothing else:
// the states of a recording, which meet in tracks of limited length, and what they all share.
// (George and Liu, "Computer Solution of Large Sparse Positive Definite Systems", 1981, chapter 4.)
#pragma once

#include <vector>

#include <Eigen/Core>

namespace plumbline::estimator {

class BorderedBand {
 public:
  using Block = Eigen::Map<Eigen::MatrixXd, Eigen::Unaligned, Eigen::OuterStride<>>;

  BorderedBand() = default;
  // reach[j] is one past the last row of B that column j has something in; `border` rows follow.
  BorderedBand(std::vector<int> reach, int border);

  int size() const { return banded_ + border(); }
  int banded() const { return banded_; }
  int border() const { return static_cast<int>(border_.rows()); }
  void set_zero();

  // Element (row, col), row >= col. With those around it, all of them rows of B or all of the border, it is a block of
  // a column-major matrix with stride(row) from column to column. A block on the diagonal may be written to above it as
  // well, up to kMostAbove columns away; what is there means nothing.
  static constexpr int kMostAbove = 14;
  double* at(int row, int col);
  int stride(int row) const { return row < banded_ ? height_ - 1 : border(); }
  Block block(int row, int col, int rows, int cols) {
    return {at(row, col), rows, cols, Eigen::OuterStride<>(stride(row))};
  }

  // A = L L^T, in place. False where A is not positive definite.
  bool factor();
  // Of the factor: x = L^-1 x, x = L^-T x, and the last rows and columns.
  void solve_lower(Eigen::VectorXd& x) const;
  void solve_upper(Eigen::VectorXd& x) const;
  Eigen::MatrixXd trailing(int n) const;

  // Full, lower.
  Eigen::MatrixXd dense() const;

 private:
  using ConstBlock = Eigen::Map<const Eigen::MatrixXd, Eigen::Unaligned, Eigen::OuterStride<>>;
  const double* at(int row, int col) const { return const_cast<BorderedBand*>(this)->at(row, col); }
  ConstBlock block(int row, int col, int rows, int cols) const {
    return {at(row, col), rows, cols, Eigen::OuterStride<>(stride(row))};
  }
  int below(int panel) const;  // rows beneath the panel that begins at that column

  std::vector<int> reach_;  // never less than that of the column before
  int banded_ = 0;
  int height_ = 0;  // of a stored column, which begins at its diagonal
  Eigen::VectorXd band_;
  Eigen::MatrixXd border_;  // [C D]
};

}  // namespace plumbline::estimator
