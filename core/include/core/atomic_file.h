// Files that are there whole or not at all, whenever the power goes.
#pragma once

#include <filesystem>
#include <functional>
#include <string_view>

namespace plumbline::core {

// Writes a temporary file beside `path` (PATH.tmp-PID-K, never shared between writers), syncs it, and renames it to
// `path`. A path that exists and is no regular file (a pipe, /dev/stdout) is written to directly.
// Throws std::system_error naming the path; the temporary file is then removed.
void write_file_atomically(const std::filesystem::path& path, std::string_view text);

// The same, unless `path` holds just that already.
void write_file_if_changed(const std::filesystem::path& path, std::string_view text);

// For what is written piece by piece: `write` makes the file whose name it is given (PATH.tmp-PID), which then becomes
// `path`, or goes where `write` throws. Throws DataError where `path` exists and is no regular file.
void replace_file_atomically(const std::filesystem::path& path,
                             const std::function<void(const std::filesystem::path& temporary)>& write);

// Syncs the closed file `from`, renames it to `to` and syncs the folder. Throws std::system_error.
void publish_file(const std::filesystem::path& from, const std::filesystem::path& to);

// Throws DataError where the path cannot come to be, since what should be one of its folders is a file.
void require_no_file_above(const std::filesystem::path& path);

}  // namespace plumbline::core
