// Monte-Carlo trials on a fixed number of threads or of worker processes.
//
// A trial is a function of its index alone and answers with text, so that it does not matter who runs it, nor when. The
// sink is called one at a time, in the order in which the trials end.
#pragma once

#include <atomic>
#include <functional>
#include <stdexcept>
#include <string>
#include <vector>

namespace plumbline::eval {

enum class Outcome {
  kAnswer,
  // The trial's fault: it would end the same way again.
  kException,
  kCrash,  // it took its process with it: a segmentation fault, an abort, an exit
  // The machine's fault: to be tried again.
  kOutOfMemory,  // std::bad_alloc
  kCpuLimit,
  kKilled,  // from outside, as by the kernel when memory runs out
};

// What a trial throws where the machine took its answer: kKilled.
class MachineFault : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

struct TrialEnd {
  int index = 0;
  Outcome outcome = Outcome::kAnswer;
  std::string text;  // the answer, or the reason why there is none
};

struct TrialRun {
  std::function<std::string(int index)> trial;
  std::function<void(const TrialEnd& end)> sink;  // what it throws ends the run and reaches the caller
  int jobs = 1;
  double cpu_limit_s = 0.0;                   // processor time of one trial, 0: none; held by processes only
  const std::atomic<bool>* cancel = nullptr;  // once true none is begun; those under way are finished and delivered
};

// Both throw std::invalid_argument unless jobs >= 1.
void run_in_threads(const std::vector<int>& indices, const TrialRun& run);

// Workers are forked, not executed anew: they hold the plan already, and any function can be a trial. The caller must
// have no other threads. A worker that dies is replaced; workers die with the caller.
void run_in_processes(const std::vector<int>& indices, const TrialRun& run);

// The trial in this thread: an answer, an exception or out of memory.
TrialEnd run_here(const TrialRun& run, int index);

}  // namespace plumbline::eval
