// One line on a terminal that tells how far a run has come; nothing where the stream is not a terminal.
#pragma once

#include <chrono>
#include <cstdio>
#include <string>

namespace plumbline::eval {

// "[#####.....]  50/100  1 failed  eta 0:01:05"; the rate so far gives the time left.
std::string progress_line(int done, int total, int failed, double elapsed_s);

// Called from one thread at a time.
class Progress {
 public:
  Progress(std::FILE* stream, int total);
  ~Progress();  // clears the line
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  void add(bool ok);

 private:
  using Clock = std::chrono::steady_clock;

  std::FILE* stream_;  // null where there is no terminal
  int total_;
  int done_ = 0;
  int failed_ = 0;
  Clock::time_point start_ = Clock::now();
  Clock::time_point drawn_;
};

}  // namespace plumbline::eval
