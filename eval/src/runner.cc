#include "eval/runner.h"

#include <cstddef>

#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/parallel_pipeline.h>
#include <oneapi/tbb/task_arena.h>

namespace plumbline::eval {

int run_in_order(int count, int jobs, const std::function<std::function<void()>(int index)>& work,
                 const std::atomic<bool>* cancel) {
  if (count < 0 || jobs < 1) throw std::invalid_argument("run_in_order: count >= 0 and jobs >= 1");
  // How far the others may run ahead of the slowest trial, which bounds the rows that wait.
  const std::size_t in_flight = 16 * static_cast<std::size_t>(jobs);

  int next = 0;
  int delivered = 0;
  // An exception that passed through the pipeline would leak what is in flight, so it waits here for the end.
  std::exception_ptr failure;
  std::atomic<bool> failed = false;
  using Delivery = std::function<void()>;
  const auto begin = [&](tbb::flow_control& control) {
    if (next == count || failed || (cancel != nullptr && *cancel)) {
      control.stop();
      return -1;
    }
    return next++;
  };
  const auto run = [&](int index) -> Delivery {
    try {
      return work(index);
    } catch (...) {
      return [error = std::current_exception()] { std::rethrow_exception(error); };
    }
  };
  const auto deliver = [&](const Delivery& delivery) {
    if (failed) return;
    try {
      delivery();
      ++delivered;
    } catch (...) {
      failure = std::current_exception();
      failed = true;
    }
  };
  // Without this TBB never uses more threads than there are processors.
  const tbb::global_control threads(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(jobs));
  tbb::task_arena arena(jobs);
  arena.execute([&] {
    tbb::parallel_pipeline(in_flight, tbb::make_filter<void, int>(tbb::filter_mode::serial_in_order, begin) &
                                          tbb::make_filter<int, Delivery>(tbb::filter_mode::parallel, run) &
                                          tbb::make_filter<Delivery, void>(tbb::filter_mode::serial_in_order, deliver));
  });
  if (failure) std::rethrow_exception(failure);
  return delivered;
}

}  // namespace plumbline::eval
