#include "eval/progress.h"

#include <cmath>

#include <fmt/format.h>
#include <unistd.h>

namespace plumbline::eval {

std::string progress_line(const ProgressCounts& c, double elapsed_s) {
  constexpr int kBar = 30;
  const int filled = c.total > 0 ? static_cast<int>(static_cast<long long>(kBar) * c.done / c.total) : kBar;
  std::string line = fmt::format("[{:#<{}}{:.<{}}]  {}/{}", "", filled, "", kBar - filled, c.done, c.total);
  if (c.done > 0) line += fmt::format("  {} ok", c.done - c.failed - c.incidents);
  if (c.failed > 0) line += fmt::format("  {} failed", c.failed);
  if (c.incidents > 0) line += fmt::format("  {} incidents", c.incidents);
  if (c.done > c.before && c.done < c.total) {
    const long long left = std::llround(elapsed_s * (c.total - c.done) / (c.done - c.before));
    line += fmt::format("  eta {}:{:02}:{:02}", left / 3600, left / 60 % 60, left % 60);
  }
  if (!c.worst.empty()) line += "  worst " + c.worst;
  return line;
}

Progress::Progress(std::FILE* stream, std::chrono::seconds log_period)
    : stream_(stream), is_terminal_(::isatty(::fileno(stream)) != 0) {
  period_ = is_terminal_ ? Clock::duration(std::chrono::milliseconds(100)) : Clock::duration(log_period);
}

Progress::~Progress() {
  if (is_terminal_) fmt::print(stream_, "\r\x1b[K");
}

void Progress::show(const ProgressCounts& counts) {
  const auto now = Clock::now();
  if (now - shown_ < period_) return;
  shown_ = now;
  const std::string line = progress_line(counts, std::chrono::duration<double>(now - start_).count());
  fmt::print(stream_, "{}{}{}", is_terminal_ ? "\r" : "", line, is_terminal_ ? "\x1b[K" : "\n");
  std::fflush(stream_);
}

void Progress::say(std::string_view line) {
  fmt::print(stream_, "{}{}\n", is_terminal_ ? "\r\x1b[K" : "", line);
  std::fflush(stream_);
}

}  // namespace plumbline::eval
