#include "estimator/bordered_band.h"

#include <algorithm>
#include <utility>

extern "C" {
void dpotrf_(const char* uplo, const int* n, double* a, const int* lda, int* info);
void dtrsm_(const char* side, const char* uplo, const char* trans, const char* diag, const int* m, const int* n,
            const double* alpha, const double* a, const int* lda, double* b, const int* ldb);
void dsyrk_(const char* uplo, const char* trans, const int* n, const int* k, const double* alpha, const double* a,
            const int* lda, const double* beta, double* c, const int* ldc);
void dgemm_(const char* trans_a, const char* trans_b, const int* m, const int* n, const int* k, const double* alpha,
            const double* a, const int* lda, const double* b, const int* ldb, const double* beta, double* c,
            const int* ldc);
}

namespace plumbline::estimator {
namespace {

constexpr double kOne = 1.0;
constexpr double kMinusOne = -1.0;
// Columns that are eliminated at once.
constexpr int kPanel = 64;

}  // namespace

BorderedBand::BorderedBand(std::vector<int> reach, int border)
    : reach_(std::move(reach)), banded_(static_cast<int>(reach_.size())), border_(border, banded_ + border) {
  int furthest = 0;
  int deepest = 0;
  for (int j = 0; j < banded_; ++j) {
    int& r = reach_[static_cast<std::size_t>(j)];
    r = furthest = std::max({furthest, r, j + 1});
    deepest = std::max(deepest, r - j / kPanel * kPanel);
  }
  height_ = kMostAbove + deepest;
  band_.resize(static_cast<Eigen::Index>(height_) * banded_ + kMostAbove);
}

double* BorderedBand::at(int row, int col) {
  if (row >= banded_) return border_.data() + (row - banded_) + static_cast<Eigen::Index>(col) * border();
  return band_.data() + kMostAbove + (row - col) + static_cast<Eigen::Index>(col) * height_;
}

int BorderedBand::below(int panel) const {
  const int next = std::min(panel + kPanel, banded_);
  return reach_[static_cast<std::size_t>(next - 1)] - next;
}

void BorderedBand::set_zero() {
  for (int j = 0; j < banded_; ++j) {
    const int panel = j / kPanel * kPanel;
    std::fill_n(at(j, j), std::min(panel + kPanel, banded_) + below(panel) - j, 0.0);
  }
  border_.setZero();
}

bool BorderedBand::factor() {
  const int ld = height_ - 1;
  const int border = this->border();
  int info = 0;
  for (int j = 0; j < banded_; j += kPanel) {
    const int n = std::min(kPanel, banded_ - j);
    const int next = j + n;
    const int below = this->below(j);
    double* const L = at(j, j);
    dpotrf_("L", &n, L, &ld, &info);
    if (info != 0) return false;
    if (below > 0) {
      double* const panel = at(next, j);
      dtrsm_("R", "L", "T", "N", &below, &n, &kOne, L, &ld, panel, &ld);
      dsyrk_("L", "N", &below, &n, &kMinusOne, panel, &ld, &kOne, at(next, next), &ld);
    }
    if (border == 0) continue;
    double* const C = &border_(0, j);
    dtrsm_("R", "L", "T", "N", &border, &n, &kOne, L, &ld, C, &border);
    if (below > 0) {
      dgemm_("N", "T", &border, &below, &n, &kMinusOne, C, &border, at(next, j), &ld, &kOne, &border_(0, next),
             &border);
    }
    dsyrk_("L", "N", &border, &n, &kMinusOne, C, &border, &kOne, &border_(0, banded_), &border);
  }
  if (border > 0) dpotrf_("L", &border, &border_(0, banded_), &border, &info);
  return info == 0;
}

void BorderedBand::solve_lower(Eigen::VectorXd& x) const {
  for (int j = 0; j < banded_; j += kPanel) {
    const int n = std::min(kPanel, banded_ - j);
    auto head = x.segment(j, n);
    block(j, j, n, n).triangularView<Eigen::Lower>().solveInPlace(head);
    x.segment(j + n, below(j)).noalias() -= block(j + n, j, below(j), n) * head;
  }
  auto tail = x.tail(border());
  tail.noalias() -= border_.leftCols(banded_) * x.head(banded_);
  border_.rightCols(border()).triangularView<Eigen::Lower>().solveInPlace(tail);
}

void BorderedBand::solve_upper(Eigen::VectorXd& x) const {
  auto tail = x.tail(border());
  border_.rightCols(border()).triangularView<Eigen::Lower>().adjoint().solveInPlace(tail);
  x.head(banded_).noalias() -= border_.leftCols(banded_).transpose() * tail;
  for (int j = (banded_ + kPanel - 1) / kPanel * kPanel - kPanel; j >= 0; j -= kPanel) {
    const int n = std::min(kPanel, banded_ - j);
    auto head = x.segment(j, n);
    head.noalias() -= block(j + n, j, below(j), n).transpose() * x.segment(j + n, below(j));
    block(j, j, n, n).triangularView<Eigen::Lower>().adjoint().solveInPlace(head);
  }
}

Eigen::MatrixXd BorderedBand::trailing(int n) const {
  Eigen::MatrixXd A = Eigen::MatrixXd::Zero(n, n);
  const int first = size() - n;
  for (int j = std::max(first, 0); j < banded_; ++j) {
    std::copy_n(at(j, j), reach_[static_cast<std::size_t>(j)] - j, &A(j - first, j - first));
  }
  const int rows = std::min(n, border());
  A.bottomRows(rows) = border_.bottomRightCorner(rows, n);
  A.triangularView<Eigen::StrictlyUpper>().setZero();
  return A;
}

Eigen::MatrixXd BorderedBand::dense() const { return trailing(size()); }

}  // namespace plumbline::estimator
