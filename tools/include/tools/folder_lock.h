// Who writes to the folder of a sweep: one program alone, or any number that run shards of it.
//
// A POSIX record lock of shards/lock: it ends with the program however that ends, workers do not inherit it, and it
// works across the machines of a cluster where the file system has locks.
#pragma once

#include <filesystem>
#include <string>

namespace plumbline::tools {

enum class LockKind { kAlone, kShared };

class FolderLock {
 public:
  // Makes the folder. Throws core::DataError that names the holder where another program has it, unless told to wait.
  FolderLock(const std::filesystem::path& out, LockKind kind, bool wait = false);
  ~FolderLock();
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;

 private:
  int file_ = -1;
};

// "process 12 on host n1", or empty where nobody writes to the folder.
std::string folder_holder(const std::filesystem::path& out);

}  // namespace plumbline::tools
