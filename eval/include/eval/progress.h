// How far a run has come: one line on a terminal, else a line now and then for logs.
#pragma once

#include <chrono>
#include <cstdio>
#include <string>
#include <string_view>

namespace plumbline::eval {

struct ProgressCounts {
  int total = 0;
  int before = 0;  // done before this program began, which tells nothing of the rate
  int done = 0;    // these among them
  int failed = 0;
  int incidents = 0;  // done neither well nor ill: the machine took them
  std::string worst;  // in words
};

// "[#####.....]  50/100  49 ok  1 failed  eta 0:01:05  worst 0.2 m (cell 0 trial 3)"; the rate so far gives the time
// left.
std::string progress_line(const ProgressCounts& counts, double elapsed_s);

// Called from one thread at a time.
class Progress {
 public:
  Progress(std::FILE* stream, std::chrono::seconds log_period = std::chrono::seconds(30));
  ~Progress();  // clears the line
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  void show(const ProgressCounts& counts);
  void say(std::string_view line);  // above the line of progress

 private:
  using Clock = std::chrono::steady_clock;

  std::FILE* stream_;
  bool is_terminal_;
  Clock::duration period_;
  Clock::time_point start_ = Clock::now();
  Clock::time_point shown_ = start_;
};

}  // namespace plumbline::eval
