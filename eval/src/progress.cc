#include "eval/progress.h"

#include <cmath>

#include <fmt/format.h>
#include <unistd.h>

namespace plumbline::eval {

std::string progress_line(int done, int total, int failed, double elapsed_s) {
  constexpr int kBar = 30;
  const int filled = total > 0 ? static_cast<int>(static_cast<long long>(kBar) * done / total) : kBar;
  std::string line = fmt::format("[{:#<{}}{:.<{}}]  {}/{}", "", filled, "", kBar - filled, done, total);
  if (failed > 0) line += fmt::format("  {} failed", failed);
  if (done > 0 && done < total) {
    const long long left = std::llround(elapsed_s * (total - done) / done);
    line += fmt::format("  eta {}:{:02}:{:02}", left / 3600, left / 60 % 60, left % 60);
  }
  return line;
}

Progress::Progress(std::FILE* stream, int total)
    : stream_(::isatty(::fileno(stream)) != 0 ? stream : nullptr), total_(total) {}

Progress::~Progress() {
  if (stream_ != nullptr) fmt::print(stream_, "\r\x1b[K");
}

void Progress::add(bool ok) {
  ++done_;
  failed_ += ok ? 0 : 1;
  const auto now = Clock::now();
  if (stream_ == nullptr || now - drawn_ < std::chrono::milliseconds(100)) return;
  drawn_ = now;
  const double elapsed_s = std::chrono::duration<double>(now - start_).count();
  fmt::print(stream_, "\r{}\x1b[K", progress_line(done_, total_, failed_, elapsed_s));
  std::fflush(stream_);
}

}  // namespace plumbline::eval
