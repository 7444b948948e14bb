#include "tools/sweep_folder.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <fstream>
#include <memory>
#include <optional>
#include <system_error>

#include <fcntl.h>
#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <unistd.h>

#include "core/atomic_file.h"
#include "core/error.h"

namespace plumbline::tools {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

constexpr std::size_t kMostOpenFiles = 256;

[[noreturn]] void fail(const fs::path& path, const char* action) {
  throw std::system_error(errno, std::generic_category(), fmt::format("{}: cannot {}", path.generic_string(), action));
}

// What is read of a record to file it.
struct Record {
  enum class Kind { kRow, kTimings, kIncident } kind = Kind::kRow;
  int index = 0;
  bool ok = false;
};

// Throws core::DataError for what is no record; nothing comes back for one of another plan.
std::optional<Record> parse_record(const Plan& plan, const std::string& line, const std::string& where) {
  Record record;
  const ordered_json json = ordered_json::parse(line, nullptr, false);
  if (!json.is_object()) throw core::DataError(where + ": not a JSON object");
  if (json.contains("cause")) {
    record.kind = Record::Kind::kIncident;
  } else if (json.contains("simulate_s")) {
    record.kind = Record::Kind::kTimings;
  } else {
    record.ok = eval::parse_row(line, where).ok;
  }
  const auto number = [&](const char* key) {
    if (!json.contains(key) || !json[key].is_number_unsigned()) throw core::DataError(where + ": " + key + ": missing");
    return json[key].get<std::uint64_t>();
  };
  const std::uint64_t cell = number("cell");
  const std::uint64_t trial = number("trial");
  const auto trials = static_cast<std::uint64_t>(plan.base.experiment.trials);
  if (cell >= plan.cells.size() || trial >= trials) return std::nullopt;
  record.index = static_cast<int>(cell * trials + trial);
  if (json.value("run_id", "") != identity(plan, record.index).run_id) return std::nullopt;
  return record;
}

// Written whole: files reach the disk in order but perhaps not to their end before the power goes.
bool is_whole(const fs::path& series) {
  std::ifstream file(series, std::ios::binary);
  return file.seekg(-1, std::ios::end) && file.get() == '\n';
}

class Reader {
 public:
  Reader(const Plan& plan, const fs::path& out) : plan_(plan), out_(out) {
    state_.runs.resize(static_cast<std::size_t>(plan.runs()));
  }

  // A file that is gone was published by another program, which was done before it removed it.
  void read(const fs::path& path) {
    std::ifstream file(path, std::ios::binary);
    if (!file) {
      if (fs::exists(path)) fail(path, "read");
      return;
    }
    const bool journal = path.parent_path().filename() == "shards";
    const auto index = static_cast<std::int32_t>(state_.files.size());
    state_.files.push_back(path);
    std::int64_t offset = 0;
    std::string line;
    for (int number = 1; std::getline(file, line); ++number) {
      const std::string where = fmt::format("{}:{}", path.generic_string(), number);
      if (file.eof()) {  // getline met the end of the file before the end of the line
        if (!journal) state_.damaged.push_back(where + ": the last line is not complete");
        return;
      }
      try {
        add(line, {index, static_cast<std::uint32_t>(line.size()), offset}, journal, where);
      } catch (const core::DataError& error) {
        state_.damaged.emplace_back(error.what());
      }
      offset += static_cast<std::int64_t>(line.size()) + 1;
    }
  }

  SweepState take() { return std::move(state_); }

 private:
  void add(const std::string& line, const Place& place, bool journal, const std::string& where) {
    const std::optional<Record> record = parse_record(plan_, line, where);
    if (!record) {
      state_.conflicts.push_back(where + ": is of another plan");
      return;
    }
    RunState& run = state_.runs[static_cast<std::size_t>(record->index)];
    if (record->kind == Record::Kind::kTimings) {
      run.timings = place;
    } else if (record->kind == Record::Kind::kIncident) {
      run.incident = place;
    } else if (run.row) {
      if (state_.read(run.row) == line) return;
      const eval::Row id = identity(plan_, record->index);
      state_.conflicts.push_back(fmt::format("{}: cell {} trial {} differs from its row in {}", where, id.cell,
                                             id.trial,
                                             state_.files[static_cast<std::size_t>(run.row.file)].generic_string()));
    } else {
      const fs::path series = out_ / "series" / (identity(plan_, record->index).run_id + ".json");
      if (record->ok && journal && !is_whole(series)) {
        throw core::DataError(fmt::format("{}: {} is not whole", where, series.generic_string()));
      }
      run.row = place;
      run.ok = record->ok;
    }
  }

  const Plan& plan_;
  const fs::path& out_;
  SweepState state_;
};

std::vector<fs::path> journals(const fs::path& out) {
  std::vector<fs::path> files;
  std::error_code none;
  for (const auto& entry : fs::directory_iterator(out / "shards", none)) {
    if (entry.path().extension() == ".jsonl") files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

// Copies lines from their places, with some files open at a time.
class Copier {
 public:
  explicit Copier(const SweepState& state) : state_(state), open_(state.files.size()) {}

  void copy(const Place& place, std::ostream& to) {
    if (!place) return;
    std::ifstream& from = open(static_cast<std::size_t>(place.file));
    line_.resize(place.size);
    if (!from.seekg(place.offset) || !from.read(line_.data(), static_cast<std::streamsize>(place.size))) {
      fail(state_.files[static_cast<std::size_t>(place.file)], "read");
    }
    to << line_ << '\n';
  }

 private:
  std::ifstream& open(std::size_t file) {
    if (!open_[file]) {
      if (count_ == kMostOpenFiles) {
        for (auto& stream : open_) stream.reset();
        count_ = 0;
      }
      open_[file] = std::make_unique<std::ifstream>(state_.files[file], std::ios::binary);
      ++count_;
    }
    return *open_[file];
  }

  const SweepState& state_;
  std::vector<std::unique_ptr<std::ifstream>> open_;
  std::size_t count_ = 0;
  std::string line_;
};

fs::path temporary_of(const fs::path& path) { return path.string() + ".tmp"; }

void write_lines(const fs::path& path, const std::function<void(std::ostream&)>& write) {
  std::ofstream file(path, std::ios::binary | std::ios::trunc);
  if (!file) fail(path, "open");
  write(file);
  file.close();
  if (!file) fail(path, "write");
}

// What writers that were killed left behind.
void remove_temporaries(const fs::path& folder) {
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (entry.path().filename().string().find(".tmp-") != std::string::npos) fs::remove(entry.path());
  }
}

void sync_file_system(const fs::path& folder) {
  const int file = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (file < 0) fail(folder, "open");
  const int failed = ::syncfs(file);
  ::close(file);
  if (failed != 0) fail(folder, "sync");
}

}  // namespace

eval::Row identity(const Plan& plan, int index) {
  const int trials = plan.base.experiment.trials;
  eval::Row row;
  row.cell = index / trials;
  row.trial = index % trials;
  row.seed = plan.base.experiment.seed;
  row.run_id = run_id(plan.cells[static_cast<std::size_t>(row.cell)], row.trial);
  return row;
}

std::string timings_line(const eval::Row& row, const TrialTimings& timings) {
  return ordered_json{{"run_id", row.run_id},
                      {"cell", row.cell},
                      {"trial", row.trial},
                      {"simulate_s", timings.simulate_s},
                      {"estimate_s", timings.estimate_s},
                      {"evaluate_s", timings.evaluate_s}}
      .dump();
}

std::string incident_line(const eval::Row& row, const std::string& cause, const std::string& replay) {
  return ordered_json{{"run_id", row.run_id}, {"cell", row.cell}, {"trial", row.trial},
                      {"seed", row.seed},     {"cause", cause},   {"replay", replay}}
      .dump(-1, ' ', false, ordered_json::error_handler_t::replace);
}

std::string SweepState::read(const Place& place) const {
  std::ifstream file(files.at(static_cast<std::size_t>(place.file)), std::ios::binary);
  std::string line(place.size, '\0');
  file.seekg(place.offset);
  file.read(line.data(), static_cast<std::streamsize>(line.size()));
  return line;
}

std::vector<int> SweepState::incomplete() const {
  std::vector<int> indices;
  for (std::size_t i = 0; i < runs.size(); ++i) {
    if (!runs[i].row) indices.push_back(static_cast<int>(i));
  }
  return indices;
}

bool SweepState::has_journals() const {
  return std::any_of(files.begin(), files.end(),
                     [](const fs::path& file) { return file.parent_path().filename() == "shards"; });
}

SweepState read_state(const Plan& plan, const fs::path& out) {
  Reader reader(plan, out);
  for (const fs::path& file : journals(out)) reader.read(file);
  for (const char* name : {"results.jsonl", "timings.jsonl", "incidents.jsonl"}) reader.read(out / name);
  return reader.take();
}

void require_sound(const SweepState& state) {
  for (const std::string& line : state.damaged) fmt::print(stderr, "plumbline: {}; its run counts as missing\n", line);
  if (state.conflicts.empty()) return;
  const std::size_t others = state.conflicts.size() - 1;
  throw core::DataError(state.conflicts.front() + (others > 0 ? fmt::format(" (and {} more)", others) : "") +
                        "; remove what is wrong, or discard all with run --fresh");
}

void publish(const SweepState& state, const fs::path& out) {
  Copier copier(state);
  const auto write = [&](const char* name, const std::function<void(const RunState&, std::ostream&)>& one) {
    write_lines(temporary_of(out / name), [&](std::ostream& to) {
      for (const RunState& run : state.runs) one(run, to);
    });
  };
  write("results.jsonl", [&](const RunState& run, std::ostream& to) { copier.copy(run.row, to); });
  write("timings.jsonl", [&](const RunState& run, std::ostream& to) {
    if (run.row) copier.copy(run.timings, to);
  });
  write("incidents.jsonl", [&](const RunState& run, std::ostream& to) {
    if (!run.row) copier.copy(run.incident, to);
  });
  remove_temporaries(out);
  remove_temporaries(out / "series");
  sync_file_system(out);  // the series, which were not synced one by one
  for (const char* name : {"incidents.jsonl", "timings.jsonl", "results.jsonl"}) {
    core::publish_file(temporary_of(out / name), out / name);
  }
  for (const auto& entry : fs::directory_iterator(out / "shards")) {
    if (entry.path().filename() != "lock") fs::remove(entry.path());
  }
}

void publish_shard(const SweepState& state, const Journal& journal, const fs::path& file,
                   const std::function<bool(int index)>& belongs) {
  Copier copier(state);
  const fs::path temporary = temporary_of(journal.path());
  write_lines(temporary, [&](std::ostream& to) {
    for (std::size_t i = 0; i < state.runs.size(); ++i) {
      const RunState& run = state.runs[i];
      const fs::path* from = run.row ? &state.files[static_cast<std::size_t>(run.row.file)] : nullptr;
      if (!belongs(static_cast<int>(i)) && (from == nullptr || *from != file)) continue;
      if (run.row) copier.copy(run.timings, to);
      copier.copy(run.row ? run.row : run.incident, to);
    }
  });
  core::publish_file(temporary, file);
  fs::remove(journal.path());
}

Journal::Journal(const fs::path& out, const std::string& name) {
  std::array<char, 256> host{};
  ::gethostname(host.data(), host.size() - 1);
  // Never one that was there: its last line may be torn.
  for (int k = 0; file_ < 0; ++k) {
    path_ = out / "shards" / fmt::format("{}-{}-{}-{}.jsonl", name, host.data(), ::getpid(), k);
    file_ = ::open(path_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_APPEND | O_CLOEXEC, 0666);
    if (file_ < 0 && errno != EEXIST) fail(path_, "open");
  }
}

Journal::~Journal() { ::close(file_); }

void Journal::append(std::string_view lines) {
  const ssize_t written = ::write(file_, lines.data(), lines.size());
  if (written < 0) fail(path_, "write");
  if (static_cast<std::size_t>(written) != lines.size()) {
    errno = ENOSPC;
    fail(path_, "write");
  }
}

}  // namespace plumbline::tools
