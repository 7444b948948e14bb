#include "recorder.h"

#include <cerrno>
#include <cstdio>
#include <fstream>
#include <string_view>
#include <system_error>

#include <fmt/format.h>

namespace plumbline::tools {
namespace {

namespace fs = std::filesystem;

constexpr int kMostTold = 10;

// Whole or not at all should the program be killed. Not synced, which would cost more than a short trial: read_state
// finds what a power cut has left half written.
void write_series(const fs::path& path, const std::string& suffix, std::string_view text) {
  const fs::path temporary = path.string() + ".tmp-" + suffix;
  std::ofstream file(temporary, std::ios::binary | std::ios::trunc);
  file << text;
  file.close();
  if (!file) throw std::system_error(errno, std::generic_category(), temporary.generic_string() + ": cannot write");
  fs::rename(temporary, path);
}

}  // namespace

std::string to_answer(const Finished& finished) {
  return timings_line(finished.row, finished.timings) + '\n' + eval::to_line(finished.row) + '\n' + finished.series;
}

Recorder::Recorder(const Plan& plan, const fs::path& out, Journal& journal, const SweepState& before)
    : plan_(plan), out_(out), journal_(journal), progress_(stderr) {
  counts_.total = plan.runs();
  for (const RunState& run : before.runs) {
    counts_.before += run.row ? 1 : 0;
    counts_.failed += run.row && !run.ok ? 1 : 0;
  }
  counts_.done = counts_.before;
}

void Recorder::add(const eval::TrialEnd& end) {
  ++counts_.done;
  if (end.outcome == eval::Outcome::kAnswer) {
    const std::size_t row = end.text.find('\n') + 1;
    const std::size_t series = end.text.find('\n', row) + 1;
    const eval::Row parsed = eval::parse_row(std::string_view(end.text).substr(row, series - 1 - row), "answer");
    if (series < end.text.size()) {
      write_series(out_ / "series" / (parsed.run_id + ".json"), journal_.path().filename().string(),
                   std::string_view(end.text).substr(series));
    }
    journal_.append(std::string_view(end.text).substr(0, series));
    add_row(parsed);
  } else if (end.outcome == eval::Outcome::kException || end.outcome == eval::Outcome::kCrash) {
    const eval::Row row = failed_row(plan_, end.index, end);
    journal_.append(timings_line(row, {}) + '\n' + eval::to_line(row) + '\n');
    add_row(row);
    tell(row, fmt::format("{}: {}", row.status, row.reason));
  } else {
    add_incident(end);
  }
  progress_.show(counts_);
}

void Recorder::add_row(const eval::Row& row) {
  counts_.failed += row.ok ? 0 : 1;
  for (const eval::Metric& metric : row.metrics) {
    if (metric.name != "ate_position_m" || metric.value <= worst_m_) continue;
    worst_m_ = metric.value;
    counts_.worst = fmt::format("{:.3g} m (cell {} trial {})", worst_m_, row.cell, row.trial);
  }
}

void Recorder::add_incident(const eval::TrialEnd& end) {
  const eval::Row row = identity(plan_, end.index);
  journal_.append(incident_line(row, end.text, replay_command(out_, row)) + '\n');
  ++counts_.incidents;
  tell(row, end.text + ", to be tried again at the next run");
}

void Recorder::tell(const eval::Row& row, const std::string& what) {
  if (told_ > kMostTold) return;
  if (++told_ > kMostTold) return progress_.say("plumbline: more such, see the results");
  progress_.say(fmt::format("plumbline: cell {} trial {} of seed {}: {}; {}", row.cell, row.trial, row.seed, what,
                            replay_command(out_, row)));
}

}  // namespace plumbline::tools
