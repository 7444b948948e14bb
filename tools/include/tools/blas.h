// The linear algebra below Ceres, where it is OpenBLAS, and OpenMP, which CHOLMOD uses.
#pragma once

namespace plumbline::tools {

// Both work in one thread from here on: one thread a trial, and the same bytes whatever the number of processors, since
// a sum in two parts is another number. What runs trials calls this before it starts threads or processes.
void use_one_blas_thread();

// An OpenBLAS that was built without threads does not lock its buffers either: two trials at once spoil each other's
// numbers, now and then, and nothing tells (docs/decisions/0003-solving-the-batch.md).
bool blas_is_thread_safe();

}  // namespace plumbline::tools
