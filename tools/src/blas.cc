#include "tools/blas.h"

// Absent where the BLAS is another.
extern "C" void openblas_set_num_threads(int) __attribute__((weak));
extern "C" int openblas_get_parallel(void) __attribute__((weak));  // 0: built without threads
extern "C" void omp_set_max_active_levels(int) __attribute__((weak));

namespace plumbline::tools {

void use_one_blas_thread() {
  if (openblas_set_num_threads != nullptr) openblas_set_num_threads(1);
  if (omp_set_max_active_levels != nullptr) omp_set_max_active_levels(0);
}

bool blas_is_thread_safe() { return openblas_get_parallel == nullptr || openblas_get_parallel() != 0; }

}  // namespace plumbline::tools
