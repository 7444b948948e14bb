#include "tools/folder_lock.h"

#include <array>
#include <cerrno>
#include <fstream>
#include <system_error>

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include "core/error.h"

namespace plumbline::tools {
namespace {

namespace fs = std::filesystem;

fs::path lock_file(const fs::path& out) { return out / "shards" / "lock"; }

[[noreturn]] void fail(const fs::path& file, const char* action) {
  throw std::system_error(errno, std::generic_category(), fmt::format("{}: cannot {}", file.generic_string(), action));
}

// The last one that wrote its name; of several that share the lock, one of them.
std::string written_holder(const fs::path& out) {
  std::ifstream file(lock_file(out));
  std::string holder;
  std::getline(file, holder);
  return holder.empty() ? "another program" : holder;
}

}  // namespace

FolderLock::FolderLock(const fs::path& out, LockKind kind, bool wait) {
  const fs::path file = lock_file(out);
  fs::create_directories(file.parent_path());
  file_ = ::open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
  if (file_ < 0) fail(file, "open");
  struct flock lock{};
  lock.l_type = kind == LockKind::kAlone ? F_WRLCK : F_RDLCK;
  lock.l_whence = SEEK_SET;
  int locked = -1;
  do {
    locked = ::fcntl(file_, wait ? F_SETLKW : F_SETLK, &lock);
  } while (locked != 0 && errno == EINTR);
  if (locked != 0) {
    const int error = errno;
    ::close(file_);
    if (error == EACCES || error == EAGAIN) {
      throw core::DataError(fmt::format("{}: in use by {}", out.generic_string(), written_holder(out)));
    }
    errno = error;
    fail(file, "lock");
  }
  std::array<char, 256> host{};
  ::gethostname(host.data(), host.size() - 1);
  const std::string name = fmt::format("process {} on host {}\n", ::getpid(), host.data());
  if (::ftruncate(file_, 0) != 0 || ::pwrite(file_, name.data(), name.size(), 0) < 0) {
    const int error = errno;
    ::close(file_);
    errno = error;
    fail(file, "write");
  }
}

FolderLock::~FolderLock() { ::close(file_); }

std::string folder_holder(const fs::path& out) {
  const int file = ::open(lock_file(out).c_str(), O_RDONLY | O_CLOEXEC);
  if (file < 0) return {};
  struct flock lock{};
  lock.l_type = F_WRLCK;
  lock.l_whence = SEEK_SET;
  const bool held = ::fcntl(file, F_GETLK, &lock) == 0 && lock.l_type != F_UNLCK;
  ::close(file);
  return held ? written_holder(out) : "";
}

}  // namespace plumbline::tools
