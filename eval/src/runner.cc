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
  const auto begin = [&](tbb::flow_control& control) {
    if (next == count || (cancel != nullptr && cancel->load())) {
      control.stop();
      return -1;
    }
    return next++;
  };
  const auto deliver = [&](const std::function<void()>& delivery) {
    delivery();
    ++delivered;
  };
  using Delivery = std::function<void()>;
  // Without this TBB never uses more threads than there are processors.
  const tbb::global_control threads(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(jobs));
  tbb::task_arena arena(jobs);
  arena.execute([&] {
    tbb::parallel_pipeline(in_flight, tbb::make_filter<void, int>(tbb::filter_mode::serial_in_order, begin) &
                                          tbb::make_filter<int, Delivery>(tbb::filter_mode::parallel, work) &
                                          tbb::make_filter<Delivery, void>(tbb::filter_mode::serial_in_order, deliver));
  });
  return delivered;
}

}  // namespace plumbline::eval
