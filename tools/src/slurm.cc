#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <memory>
#include <stdexcept>
#include <string_view>

#include <fmt/format.h>
#include <sys/wait.h>

#include "core/atomic_file.h"
#include "core/error.h"
#include "slurm_scripts.h"
#include "tools/sweep.h"

namespace plumbline::tools {
namespace {

namespace fs = std::filesystem;

constexpr int kMostShards = 1000;  // MaxArraySize of a Slurm that was not configured otherwise is 1001
constexpr double kLeastShardS = 30.0;

// As one word of a shell's line.
std::string shell_word(std::string_view text) {
  std::string word = "'";
  for (const char c : text) {
    if (c == '\'') word += "'\\'";
    word += c;
  }
  word += '\'';
  return word;
}

// sbatch with these arguments; the id of the job.
std::string sbatch(const std::vector<std::string>& arguments) {
  std::string command = "sbatch --parsable";
  for (const std::string& argument : arguments) command += fmt::format(" {}", shell_word(argument));
  const auto close = [](std::FILE* pipe) { ::pclose(pipe); };
  std::unique_ptr<std::FILE, decltype(close)> pipe(::popen(command.c_str(), "re"), close);
  if (!pipe) throw std::runtime_error("cannot start sbatch");
  std::array<char, 256> line{};
  std::string answer = std::fgets(line.data(), line.size(), pipe.get()) != nullptr ? line.data() : "";
  const int status = ::pclose(pipe.release());
  answer = answer.substr(0, answer.find_first_of(";\n"));  // "12" or "12;cluster"
  if (status != 0 || answer.empty()) throw std::runtime_error("sbatch did not take the job: " + command);
  return answer;
}

// As few as hold kLeastShardS of work each, at most as many as asked for. The number of an earlier submission stays,
// so that a shard that is sent again finds what it has done.
int number_of_shards(const fs::path& out, double work_s, const std::optional<int>& asked) {
  int earlier = 0;
  if (!asked && std::ifstream(out / "slurm" / "shards") >> earlier && earlier > 0) return earlier;
  const double most = std::min<double>(asked.value_or(kMostShards), kMostShards);
  return static_cast<int>(std::clamp(work_s / kLeastShardS, 1.0, most));
}

}  // namespace

int submit(const Plan& plan, const fs::path& out, const RunOptions& options, const SweepState& state, double trial_s) {
  const std::vector<int> missing = state.incomplete();
  const double work_s = trial_s * static_cast<double>(missing.size()) / std::max(1, options.jobs);
  const int shards = number_of_shards(out, work_s, options.shards);
  std::vector<bool> is_missing(static_cast<std::size_t>(shards));
  for (const int index : missing) is_missing[static_cast<std::size_t>(index % shards)] = true;
  std::string array;
  for (std::size_t i = 0; i < is_missing.size(); ++i) {
    if (is_missing[i]) array += fmt::format("{}{}", array.empty() ? "" : ",", i);
  }

  const fs::path folder = fs::absolute(out) / "slurm";
  fs::create_directories(folder);
  core::write_file_atomically(folder / "shards", fmt::format("{}\n", shards));
  core::write_file_atomically(folder / "shard.sh", kShardScript);
  core::write_file_atomically(folder / "merge.sh", kMergeScript);
  ::setenv("PLUMBLINE", fs::read_symlink("/proc/self/exe").c_str(), 1);
  ::setenv("SWEEP", fs::absolute(out).c_str(), 1);
  ::setenv("SHARDS", std::to_string(shards).c_str(), 1);
  std::vector<std::string> common;
  if (!options.partition.empty()) common.push_back("--partition=" + options.partition);
  std::vector<std::string> arguments = common;
  arguments.push_back("--array=" + array);
  arguments.push_back("--output=" + (folder / "shard-%a.log").string());
  arguments.push_back(fmt::format("--cpus-per-task={}", std::max(1, options.jobs)));
  arguments.push_back(folder / "shard.sh");
  const std::string job = sbatch(arguments);
  arguments = common;
  arguments.push_back("--dependency=afterany:" + job);
  arguments.push_back("--output=" + (folder / "merge.log").string());
  arguments.push_back(folder / "merge.sh");
  const std::string merge_job = sbatch(arguments);
  fmt::print("{} of {} runs in {} of {} shards are job {}, merged by job {}; see: plumbline status {}\n",
             missing.size(), plan.runs(), std::count(is_missing.begin(), is_missing.end(), true), shards, job,
             merge_job, out.generic_string());
  return kExitOk;
}

}  // namespace plumbline::tools
