#include "child_process.h"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <csignal>
#include <map>
#include <string_view>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <linux/close_range.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

namespace plumbline::tools {
namespace {

constexpr double kWallPerCpu = 10.0;
constexpr int kCannotExecute = 127;  // as shells have it

[[noreturn]] void throw_errno(const char* what) { throw std::system_error(errno, std::generic_category(), what); }

// This process's with what is on top.
std::vector<std::string> joined_environment(const std::vector<std::string>& on_top) {
  std::map<std::string, std::string> by_name;
  const auto put = [&](const std::string& entry) { by_name[entry.substr(0, entry.find('='))] = entry; };
  for (char** entry = environ; *entry != nullptr; ++entry) put(*entry);
  for (const std::string& entry : on_top) put(entry);
  std::vector<std::string> result;
  result.reserve(by_name.size());
  for (auto& [name, entry] : by_name) result.push_back(std::move(entry));
  return result;
}

std::vector<char*> pointers(std::vector<std::string>& words) {
  std::vector<char*> result;
  result.reserve(words.size() + 1);
  for (std::string& word : words) result.push_back(word.data());
  result.push_back(nullptr);
  return result;
}

// Reaching the limit is a signal or an error that can be told from a kill; what lies beyond it is one.
void set_limit(__rlimit_resource resource, double value) {
  const auto soft = static_cast<rlim_t>(std::ceil(value));
  const rlimit limit{soft, soft + 1};
  ::setrlimit(resource, &limit);
}

// All that the new process needs, made before the fork: other threads may hold locks of the allocator then.
struct Prepared {
  char* const* argv;
  char* const* environment;
  const char* folder;
  double cpu_limit_s;
  double memory_limit_mb;
  ::pid_t parent;
};

[[noreturn]] void become(const Prepared& p) {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (::getppid() != p.parent) ::_exit(kCannotExecute);  // it died before that took effect
  ::setpgid(0, 0);
  // What a worker ignores its programs would ignore too.
  for (const int signal : {SIGINT, SIGTERM, SIGPIPE}) std::signal(signal, SIG_DFL);
  const bool at_home = ::chdir(p.folder) == 0;
  const int in = ::open("/dev/null", O_RDONLY);
  const int out = ::open("stdout.txt", O_WRONLY | O_CREAT | O_TRUNC, 0644);
  const int err = ::open("stderr.txt", O_WRONLY | O_CREAT | O_TRUNC, 0644);
  const bool has_files = at_home && in >= 0 && out >= 0 && err >= 0;
  if (!has_files || ::dup2(in, 0) < 0 || ::dup2(out, 1) < 0 || ::dup2(err, 2) < 0) ::_exit(kCannotExecute);
  ::close_range(3, ~0U, CLOSE_RANGE_CLOEXEC);  // files and locks of the sweep
  set_limit(RLIMIT_CORE, 0.0);
  set_limit(RLIMIT_CPU, p.cpu_limit_s);
  if (p.memory_limit_mb > 0.0) set_limit(RLIMIT_AS, p.memory_limit_mb * 1024.0 * 1024.0);
  ::execve(p.argv[0], p.argv, p.environment);
  constexpr std::string_view kWhy = "cannot be executed\n";
  [[maybe_unused]] const auto written = ::write(2, kWhy.data(), kWhy.size());
  ::_exit(kCannotExecute);
}

// False where it has not ended by then.
bool wait_for(::pid_t pid, double limit_s) {
  const auto fd = static_cast<int>(::syscall(SYS_pidfd_open, pid, 0));  // glibc 2.36 declares its own for C only
  if (fd < 0) throw_errno("pidfd_open");
  ::pollfd ended{fd, POLLIN, 0};
  int ready = 0;
  do {
    ready = ::poll(&ended, 1, static_cast<int>(std::min(1e3 * limit_s, 2e9)));
  } while (ready < 0 && errno == EINTR);
  ::close(fd);
  return ready > 0;
}

double seconds(const timeval& t) { return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec); }

}  // namespace

ChildResult run_child(const ChildCommand& command) {
  std::vector<std::string> words = command.argv;
  std::vector<std::string> entries = joined_environment(command.environment);
  const std::vector<char*> argv = pointers(words);
  const std::vector<char*> environment = pointers(entries);
  const Prepared prepared{.argv = argv.data(),
                          .environment = environment.data(),
                          .folder = command.folder.c_str(),
                          .cpu_limit_s = command.cpu_limit_s,
                          .memory_limit_mb = command.memory_limit_mb,
                          .parent = ::getpid()};
  const ::pid_t pid = ::fork();
  if (pid < 0) throw_errno("fork");
  if (pid == 0) become(prepared);

  const bool in_time = wait_for(pid, kWallPerCpu * command.cpu_limit_s);
  // Also what it has left behind: as long as it is not waited for, the group's number is nobody else's.
  ::kill(-pid, SIGKILL);
  int status = 0;
  rusage usage{};
  while (::wait4(pid, &status, 0, &usage) < 0) {
    if (errno != EINTR) throw_errno("wait4");
  }
  ChildResult result{.cpu_s = seconds(usage.ru_utime) + seconds(usage.ru_stime)};
  const bool by_signal = WIFSIGNALED(status);
  result.code = by_signal ? WTERMSIG(status) : WEXITSTATUS(status);
  const bool spent = (by_signal && result.code == SIGXCPU) || result.cpu_s >= command.cpu_limit_s;
  if (!in_time) {
    result.end = ChildEnd::kWallLimit;
  } else if (result.code != 0 && spent) {
    result.end = ChildEnd::kCpuLimit;
  } else if (by_signal) {
    result.end = ChildEnd::kSignal;
  }
  return result;
}

}  // namespace plumbline::tools
