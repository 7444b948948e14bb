// Sums of outer products of short rows, the inner loops of normal equations.
#pragma once

namespace plumbline::estimator {

// A matrix of few rows, each of which is contiguous.
struct RowBlock {
  const double* data;
  int rows;
  int stride;  // from row to row
  int width;
};

// C += sign A^T B, A and B of the same number of rows, C column-major; with `lower` nothing above the diagonal of C.
// The same bytes whether or not the processor has wide registers.
void add_outer_products(const RowBlock& A, const RowBlock& B, double sign, double* C, int stride_C, bool lower = false);

}  // namespace plumbline::estimator
