#include "estimator/outer_products.h"

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#define PLUMBLINE_WIDE_REGISTERS __attribute__((target_clones("avx2", "default")))
#else
#define PLUMBLINE_WIDE_REGISTERS
#endif

namespace plumbline::estimator {
namespace {

template <int kRows>
[[gnu::always_inline]] inline void add_rows(const double* __restrict A, int stride_A, const double* __restrict B,
                                            int stride_B, int from, int to, double sign, double* __restrict C, int c) {
  double b[kRows];
  for (int k = 0; k < kRows; ++k) b[k] = sign * B[k * stride_B + c];
  for (int r = from; r < to; ++r) {
    double sum = A[r] * b[0];
    for (int k = 1; k < kRows; ++k) sum += A[k * stride_A + r] * b[k];
    C[r] += sum;
  }
}

}  // namespace

PLUMBLINE_WIDE_REGISTERS
void add_outer_products(const RowBlock& A, const RowBlock& B, double sign, double* C, int stride_C, bool lower) {
  for (int k = 0; k < A.rows; k += 4) {
    const double* const a = A.data + k * A.stride;
    const double* const b = B.data + k * B.stride;
    for (int c = 0; c < B.width; ++c) {
      double* const column = C + static_cast<long>(c) * stride_C;
      const int from = lower ? c : 0;
      switch (A.rows - k) {
        case 1:
          add_rows<1>(a, A.stride, b, B.stride, from, A.width, sign, column, c);
          break;
        case 2:
          add_rows<2>(a, A.stride, b, B.stride, from, A.width, sign, column, c);
          break;
        case 3:
          add_rows<3>(a, A.stride, b, B.stride, from, A.width, sign, column, c);
          break;
        default:
          add_rows<4>(a, A.stride, b, B.stride, from, A.width, sign, column, c);
      }
    }
  }
}

}  // namespace plumbline::estimator
