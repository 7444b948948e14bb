// Each worker has one end of a socket: an index comes in, a header and the text of a TrialEnd go out. Once the parent's
// end is closed the worker leaves; should the parent be killed, the kernel kills the worker.
#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <csignal>
#include <cstdint>
#include <cstring>
#include <ctime>
#include <memory>
#include <stdexcept>
#include <system_error>
#include <utility>

#include <fmt/format.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include "eval/runner.h"

namespace plumbline::eval {
namespace {

struct Header {
  std::int32_t outcome = 0;
  std::uint64_t size = 0;  // of the text that follows
};

[[noreturn]] void fail(const char* what) { throw std::system_error(errno, std::generic_category(), what); }

// False where the other end is gone.
bool send_all(int socket, const void* data, std::size_t size) {
  const char* at = static_cast<const char*>(data);
  while (size > 0) {
    const ssize_t sent = ::send(socket, at, size, MSG_NOSIGNAL);
    if (sent < 0 && errno == EINTR) continue;
    if (sent < 0) return false;
    at += sent;
    size -= static_cast<std::size_t>(sent);
  }
  return true;
}

// SIGXCPU, which nobody handles, once this process has used that much processor time; 0 s: never.
class CpuLimit {
 public:
  CpuLimit() {
    sigevent event{};
    event.sigev_notify = SIGEV_SIGNAL;
    event.sigev_signo = SIGXCPU;
    if (::timer_create(CLOCK_PROCESS_CPUTIME_ID, &event, &timer_) != 0) fail("timer_create");
  }
  void set(double limit_s) const {
    itimerspec after{};
    const double whole_s = std::floor(limit_s);
    after.it_value = {static_cast<std::time_t>(whole_s), static_cast<long>(1e9 * (limit_s - whole_s))};
    if (::timer_settime(timer_, 0, &after, nullptr) != 0) fail("timer_settime");
  }

 private:
  timer_t timer_{};
};

[[noreturn]] void work(int socket, ::pid_t parent, const TrialRun& run) {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (::getppid() != parent) ::_exit(0);  // it died before that took effect
  // Ctrl-C reaches the whole process group; it is the parent's to decide, and a trial under way is finished.
  std::signal(SIGINT, SIG_IGN);
  std::signal(SIGTERM, SIG_IGN);
  const CpuLimit limit;
  std::int32_t index = 0;
  while (::recv(socket, &index, sizeof index, MSG_WAITALL) == sizeof index) {
    limit.set(run.cpu_limit_s);
    const TrialEnd end = run_here(run, index);
    limit.set(0.0);
    const Header header{static_cast<std::int32_t>(end.outcome), end.text.size()};
    if (!send_all(socket, &header, sizeof header) || !send_all(socket, end.text.data(), end.text.size())) break;
  }
  ::_exit(0);
}

// Why a worker went that should not have.
TrialEnd post_mortem(int index, int status) {
  if (!WIFSIGNALED(status)) {
    return {index, Outcome::kCrash, fmt::format("left with exit code {}", WEXITSTATUS(status))};
  }
  const int signal = WTERMSIG(status);
  if (signal == SIGXCPU) return {index, Outcome::kCpuLimit, "cpu limit"};
  const std::string reason = fmt::format("killed by SIG{}", ::sigabbrev_np(signal));
  constexpr std::array kFaults = {SIGSEGV, SIGABRT, SIGBUS, SIGFPE, SIGILL, SIGTRAP, SIGSYS};
  const bool own_fault = std::find(kFaults.begin(), kFaults.end(), signal) != kFaults.end();
  return {index, own_fault ? Outcome::kCrash : Outcome::kKilled, reason};
}

class Worker {
 public:
  // `others` are closed in the new process, which must not keep them open when their worker goes.
  Worker(const TrialRun& run, const std::vector<std::unique_ptr<Worker>>& others) {
    std::array<int, 2> ends{};
    if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0) fail("socketpair");
    const ::pid_t parent = ::getpid();
    pid_ = ::fork();
    if (pid_ == 0) {
      ::close(ends[0]);
      for (const auto& other : others) {
        if (other) ::close(other->socket_);
      }
      work(ends[1], parent, run);
    }
    const int error = errno;
    ::close(ends[1]);
    socket_ = ends[0];
    if (pid_ < 0) {
      ::close(socket_);
      errno = error;
      fail("fork");
    }
  }
  Worker(const Worker&) = delete;
  Worker& operator=(const Worker&) = delete;
  ~Worker() {
    if (is_busy()) ::kill(pid_, SIGKILL);  // only where the run ends early
    ::close(socket_);
    if (pid_ > 0) reap();
  }

  bool is_busy() const { return index_ >= 0; }
  int socket() const { return socket_; }

  // False where the worker is gone.
  bool begin(std::int32_t index) {
    if (!send_all(socket_, &index, sizeof index)) return false;
    index_ = index;
    return true;
  }

  // Takes what has come. True once the trial has ended, also by the death of the worker.
  bool receive(TrialEnd& end) {
    std::array<char, 1 << 16> buffer;
    const ssize_t n = ::recv(socket_, buffer.data(), buffer.size(), 0);
    if (n < 0 && errno == EINTR) return false;
    if (n <= 0) {
      end = post_mortem(std::exchange(index_, -1), reap());
      return true;
    }
    received_.append(buffer.data(), static_cast<std::size_t>(n));
    Header header;
    if (received_.size() < sizeof header) return false;
    std::memcpy(&header, received_.data(), sizeof header);
    if (received_.size() < sizeof header + header.size) return false;
    end = {std::exchange(index_, -1), static_cast<Outcome>(header.outcome), received_.substr(sizeof header)};
    received_.clear();
    return true;
  }

  bool is_gone() const { return pid_ < 0; }

 private:
  int reap() {
    int status = 0;
    while (::waitpid(pid_, &status, 0) < 0 && errno == EINTR) {
    }
    pid_ = -1;
    return status;
  }

  ::pid_t pid_ = -1;
  int socket_ = -1;
  std::int32_t index_ = -1;  // of the trial under way
  std::string received_;
};

}  // namespace

void run_in_processes(const std::vector<int>& indices, const TrialRun& run) {
  if (run.jobs < 1) throw std::invalid_argument("run_in_processes: jobs >= 1");
  std::vector<std::unique_ptr<Worker>> workers(std::min(indices.size(), static_cast<std::size_t>(run.jobs)));
  std::size_t next = 0;
  const auto keep_busy = [&](std::unique_ptr<Worker>& worker) {
    while (next < indices.size() && (run.cancel == nullptr || !*run.cancel)) {
      if (!worker || worker->is_gone()) {
        worker.reset();
        worker = std::make_unique<Worker>(run, workers);
      }
      if (worker->begin(indices[next])) {
        ++next;
        return;
      }
      worker.reset();  // killed while it had nothing to do
    }
  };
  for (auto& worker : workers) keep_busy(worker);
  for (;;) {
    std::vector<::pollfd> sockets;
    std::vector<std::unique_ptr<Worker>*> busy;
    for (auto& worker : workers) {
      if (!worker || !worker->is_busy()) continue;
      sockets.push_back({worker->socket(), POLLIN, 0});
      busy.push_back(&worker);
    }
    if (busy.empty()) return;
    if (::poll(sockets.data(), sockets.size(), -1) < 0 && errno != EINTR) fail("poll");
    for (std::size_t i = 0; i < busy.size(); ++i) {
      TrialEnd end;
      if (sockets[i].revents == 0 || !(*busy[i])->receive(end)) continue;
      keep_busy(*busy[i]);  // before the sink, so that the worker need not wait for it
      run.sink(end);
    }
  }
}

}  // namespace plumbline::eval
