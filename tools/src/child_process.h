// A program of somebody else's, with limits that the kernel keeps: argv as it stands, no shell. It is the leader of a
// process group of its own, which ends with it, and it ends with the thread that started it.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace plumbline::tools {

struct ChildCommand {
  std::vector<std::string> argv;         // the first is the path of the program
  std::vector<std::string> environment;  // NAME=VALUE, in place of this process's or beside them; of two the later
  std::filesystem::path folder;          // where it starts; its output goes to stdout.txt and stderr.txt there
  double cpu_limit_s = 0.0;              // of each process, in whole seconds; and ten times as long on the wall
  double memory_limit_mb = 0.0;          // address space of each process; 0: none
};

enum class ChildEnd { kExit, kSignal, kCpuLimit, kWallLimit };

struct ChildResult {
  ChildEnd end = ChildEnd::kExit;
  int code = 0;        // of the exit, or the signal
  double cpu_s = 0.0;  // of the program and of what it waited for
};

// Throws std::system_error where it cannot be started; a file that is no program exits with 127.
ChildResult run_child(const ChildCommand& command);

}  // namespace plumbline::tools
