#include "tools/external_estimator.h"

#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <sstream>
#include <stdexcept>
#include <system_error>
#include <vector>

#include <fmt/format.h>
#include <unistd.h>

#include "child_process.h"
#include "core/dataset.h"
#include "core/error.h"
#include "eval/runner.h"

namespace plumbline::tools {
namespace {

namespace fs = std::filesystem;

std::vector<std::string> words_of(const std::string& text) {
  std::istringstream stream(text);
  return {std::istream_iterator<std::string>(stream), {}};
}

// Where things lie differs from run to run.
std::string without(std::string text, const fs::path& folder) {
  const std::string prefix = folder.string() + "/";
  for (std::size_t at = text.find(prefix); at != std::string::npos; at = text.find(prefix, at)) {
    text.erase(at, prefix.size());
  }
  return text;
}

// ": " and the last line that says something, where there is one.
std::string last_words(const fs::path& file) {
  constexpr std::size_t kMost = 300;
  std::ifstream stream(file, std::ios::binary);
  std::string last;
  for (std::string line; std::getline(stream, line);) {
    if (line.find_first_not_of(" \t\r") != std::string::npos) last = line.substr(0, kMost);
  }
  return last.empty() ? "" : fmt::format(": {}", last);
}

// Empty where it did what it should.
std::string failure_of(const ChildResult& child, const estimator::ExternalConfig& config) {
  switch (child.end) {
    case ChildEnd::kExit:
      return child.code == 0 ? "" : fmt::format("exit code {}", child.code);
    case ChildEnd::kSignal:
      return fmt::format("killed by SIG{}", ::sigabbrev_np(child.code));
    case ChildEnd::kCpuLimit:
      return fmt::format("more than {} s of processor time (estimator.external.cpu_limit_s)", config.cpu_limit_s);
    case ChildEnd::kWallLimit:
      return fmt::format("not done after ten times {} s (estimator.external.cpu_limit_s)", config.cpu_limit_s);
  }
  throw std::logic_error("failure_of: unknown end");
}

ChildResult start(const fs::path& dataset, const estimator::ExternalConfig& config, const fs::path& out) {
  ChildCommand command{.argv = {config.command.string()},
                       // The number of threads would show in the sums.
                       .environment = {"OMP_NUM_THREADS=1", "OPENBLAS_NUM_THREADS=1"},
                       .folder = out,
                       .cpu_limit_s = config.cpu_limit_s,
                       .memory_limit_mb = config.memory_limit_mb};
  for (const std::string& word : words_of(config.arguments)) command.argv.push_back(word);
  for (const std::string& word : {std::string("--dataset"), dataset.string(), std::string("--out"), out.string()}) {
    command.argv.push_back(word);
  }
  command.environment.push_back(fmt::format("PLUMBLINE_DATASET={}", dataset.string()));
  command.environment.push_back(fmt::format("PLUMBLINE_OUT={}", out.string()));
  for (const std::string& entry : words_of(config.environment)) command.environment.push_back(entry);
  return run_child(command);
}

}  // namespace

void require_runnable(const estimator::ExternalConfig& config) {
  const std::string key = "estimator.external.command";
  if (config.command.empty()) throw core::RuleError({key, "must name the program of estimator.type: external"});
  if (!fs::is_regular_file(config.command) || ::access(config.command.c_str(), X_OK) != 0) {
    throw core::RuleError({key, fmt::format("{} is no program", config.command.generic_string())});
  }
  for (const std::string& entry : words_of(config.environment)) {
    if (entry.find('=') == std::string::npos || entry.starts_with('=')) {
      throw core::RuleError({"estimator.external.environment", fmt::format("'{}' is not NAME=VALUE", entry)});
    }
  }
}

ExternalEstimate estimate_externally(const core::MeasurementLog& log, const estimator::ExternalConfig& config,
                                     const fs::path& out) {
  try {
    const ScratchFolder scratch;
    const fs::path dataset = scratch.path() / "dataset";
    core::write_dataset(dataset, log, {});
    fs::create_directories(out);
    const fs::path home = fs::absolute(out);
    const ChildResult child = start(dataset, config, home);
    if (child.end == ChildEnd::kSignal && child.code == SIGKILL) throw eval::MachineFault("its program was killed");

    ExternalEstimate estimate;
    estimate.cpu_s = child.cpu_s;
    estimate.failure = failure_of(child, config);
    if (!estimate.failure.empty()) {
      estimate.failure = without(without(estimate.failure + last_words(home / "stderr.txt"), home), scratch.path());
      return estimate;
    }
    try {
      estimate.stated = read_stated_estimate(home);
    } catch (const core::InputError& error) {
      estimate.failure = without(error.what(), home);
    }
    return estimate;
  } catch (const std::system_error& error) {
    throw eval::MachineFault(error.what());
  }
}

ScratchFolder::ScratchFolder() {
  std::string name = (fs::temp_directory_path() / "plumbline-XXXXXX").string();
  if (::mkdtemp(name.data()) == nullptr) throw std::system_error(errno, std::generic_category(), name);
  path_ = name;
}

ScratchFolder::~ScratchFolder() {
  std::error_code ignored;
  fs::remove_all(path_, ignored);
}

}  // namespace plumbline::tools
