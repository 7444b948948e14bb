#include "eval/runner.h"

#include <algorithm>
#include <exception>
#include <mutex>
#include <new>
#include <thread>

namespace plumbline::eval {

TrialEnd run_here(const TrialRun& run, int index) {
  try {
    return {index, Outcome::kAnswer, run.trial(index)};
  } catch (const std::bad_alloc&) {
    return {index, Outcome::kOutOfMemory, "out of memory"};
  } catch (const MachineFault& fault) {
    return {index, Outcome::kKilled, fault.what()};
  } catch (const std::exception& error) {
    return {index, Outcome::kException, error.what()};
  } catch (...) {
    return {index, Outcome::kException, "an exception of unknown type"};
  }
}

void run_in_threads(const std::vector<int>& indices, const TrialRun& run) {
  if (run.jobs < 1) throw std::invalid_argument("run_in_threads: jobs >= 1");
  std::atomic<std::size_t> next = 0;
  std::atomic<bool> failed = false;
  std::exception_ptr failure;
  std::mutex one_at_a_time;
  const auto work = [&] {
    while (!failed && (run.cancel == nullptr || !*run.cancel)) {
      const std::size_t k = next++;
      if (k >= indices.size()) return;
      const TrialEnd end = run_here(run, indices[k]);
      const std::lock_guard lock(one_at_a_time);
      if (failed) return;
      try {
        run.sink(end);
      } catch (...) {
        failure = std::current_exception();
        failed = true;
      }
    }
  };
  {
    std::vector<std::jthread> threads;
    const std::size_t count = std::min(indices.size(), static_cast<std::size_t>(run.jobs));
    threads.reserve(count);
    for (std::size_t i = 0; i < count; ++i) threads.emplace_back(work);
  }
  if (failure) std::rethrow_exception(failure);
}

}  // namespace plumbline::eval
