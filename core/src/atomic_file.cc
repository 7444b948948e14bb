#include "core/atomic_file.h"

#include <cerrno>
#include <cstdio>
#include <fstream>
#include <memory>
#include <sstream>
#include <string>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include "core/error.h"

namespace plumbline::core {
namespace {

namespace fs = std::filesystem;

struct Close {
  void operator()(std::FILE* file) const { std::fclose(file); }
};
using File = std::unique_ptr<std::FILE, Close>;

[[noreturn]] void fail(const fs::path& path, const char* action) {
  throw std::system_error(errno, std::generic_category(), fmt::format("{}: cannot {}", path.string(), action));
}

void write_all(File file, const fs::path& path, std::string_view text) {
  const bool written = std::fwrite(text.data(), 1, text.size(), file.get()) == text.size();
  if (!written || std::fclose(file.release()) != 0) fail(path, "write");
}

void sync(const fs::path& path, int flags) {
  const int fd = ::open(path.c_str(), flags | O_CLOEXEC);
  if (fd < 0) fail(path, "open");
  const int failed = ::fsync(fd);
  const int error = errno;
  ::close(fd);
  errno = error;
  // Some network file systems cannot sync a folder; the rename itself is still atomic there.
  const bool unsupported = errno == EINVAL && (flags & O_DIRECTORY) != 0;
  if (failed != 0 && !unsupported) fail(path, "sync");
}

}  // namespace

void publish_file(const fs::path& from, const fs::path& to) {
  sync(from, O_RDONLY);
  if (std::rename(from.c_str(), to.c_str()) != 0) fail(to, "rename to");
  sync(to.has_parent_path() ? to.parent_path() : fs::path("."), O_RDONLY | O_DIRECTORY);
}

void require_no_file_above(const fs::path& path) {
  std::error_code none;
  for (fs::path folder = path.parent_path(); !folder.empty(); folder = folder.parent_path()) {
    const fs::file_status status = fs::status(folder, none);
    if (fs::exists(status) && !fs::is_directory(status)) {
      throw DataError(
          fmt::format("{}: cannot be made, {} is not a folder", path.generic_string(), folder.generic_string()));
    }
    if (folder == folder.parent_path()) return;
  }
}

void write_file_if_changed(const fs::path& path, std::string_view text) {
  std::ostringstream old;
  old << std::ifstream(path, std::ios::binary).rdbuf();
  if (!fs::exists(path) || old.view() != text) write_file_atomically(path, text);
}

void replace_file_atomically(const fs::path& path, const std::function<void(const fs::path& temporary)>& write) {
  std::error_code none;
  const fs::file_status status = fs::status(path, none);
  if (fs::exists(status) && !fs::is_regular_file(status)) {
    throw DataError(fmt::format("{}: exists and is not a file", path.generic_string()));
  }
  require_no_file_above(path);
  const fs::path temporary = fmt::format("{}.tmp-{}", path.string(), ::getpid());
  fs::remove(temporary, none);  // of an earlier process of the same number
  try {
    write(temporary);
    publish_file(temporary, path);
  } catch (...) {
    fs::remove(temporary, none);
    throw;
  }
}

void write_file_atomically(const fs::path& path, std::string_view text) {
  std::error_code none;
  const fs::file_status status = fs::status(path, none);
  if (fs::exists(status) && !fs::is_regular_file(status)) {
    File file(std::fopen(path.c_str(), "we"));
    if (!file) fail(path, "open");
    return write_all(std::move(file), path, text);
  }
  File file;
  fs::path temporary;
  // The name of an earlier process of the same number may have been left behind by a power cut.
  for (int k = 0; !file; ++k) {
    temporary = fmt::format("{}.tmp-{}-{}", path.string(), ::getpid(), k);
    file.reset(std::fopen(temporary.c_str(), "wxe"));
    if (!file && errno != EEXIST) fail(path, "open");
  }
  try {
    write_all(std::move(file), path, text);
    publish_file(temporary, path);
  } catch (...) {
    fs::remove(temporary, none);
    throw;
  }
}

}  // namespace plumbline::core
