// Monte-Carlo trials on a fixed number of threads. Trials run side by side; everything else is called one at a time in
// the order of the indices, so that what comes out does not depend on the number of threads.
#pragma once

#include <atomic>
#include <exception>
#include <functional>
#include <memory>
#include <new>
#include <stdexcept>

namespace plumbline::eval {

// What to do with the trials' answers. An exception that one of these throws ends the run and reaches the caller.
template <class Row>
struct TrialHandlers {
  // The row of a trial that was answered, or of one that failed.
  std::function<void(int index, const Row& row)> sink;
  // The row of a trial that threw: a result like any other, since the same trial throws again.
  std::function<Row(int index, const std::exception& error)> failed_row;
  // A trial that ran out of memory: the machine's fault, so no row; it is to be tried again.
  std::function<void(int index)> incident;
};

// Runs work(0), ..., work(count - 1) on up to `jobs` threads (the caller's among them) and calls what each returned in
// the order of the indices. After *cancel turns true no further one is begun; those under way are finished and
// delivered. Returns how many were: always 0, 1, ..., so none is missing between. Throws std::invalid_argument unless
// count >= 0 and jobs >= 1.
int run_in_order(int count, int jobs, const std::function<std::function<void()>(int index)>& work,
                 const std::atomic<bool>* cancel = nullptr);

template <class Row>
int run_trials(int count, int jobs, const std::function<Row(int index)>& trial, const TrialHandlers<Row>& handlers,
               const std::atomic<bool>* cancel = nullptr) {
  const auto work = [&](int index) -> std::function<void()> {
    try {
      return [&handlers, index, row = std::make_shared<const Row>(trial(index))] { handlers.sink(index, *row); };
    } catch (const std::bad_alloc&) {
      return [&handlers, index] { handlers.incident(index); };
    } catch (...) {
      return [&handlers, index, error = std::current_exception()] {
        try {
          std::rethrow_exception(error);
        } catch (const std::exception& known) {
          handlers.sink(index, handlers.failed_row(index, known));
        } catch (...) {
          handlers.sink(index, handlers.failed_row(index, std::runtime_error("an exception of unknown type")));
        }
      };
    }
  };
  return run_in_order(count, jobs, work, cancel);
}

}  // namespace plumbline::eval
