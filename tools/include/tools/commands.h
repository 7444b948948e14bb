// The subcommands of `plumbline`. Each returns the exit code:
//   0 ok; 1 the answer is "worse", or trials failed beyond the allowed share; 2 bad input; 3 internal.
// Bad input is thrown as core::InputError before anything is written; program() turns it into code 2.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "eval/alignment.h"
#include "eval/relative_error.h"

namespace plumbline::tools {

inline constexpr int kExitOk = 0;
inline constexpr int kExitWorse = 1;
inline constexpr int kExitBadInput = 2;
inline constexpr int kExitInternal = 3;

enum class Launcher { kProcesses, kThreads, kSlurm };
inline constexpr std::array<std::string_view, 3> kLauncherNames = {"processes", "threads", "slurm"};

// The runs whose number leaves `index` when divided by `of`.
struct Shard {
  int index = 0;
  int of = 1;
};

// Of a sweep that has ended, on stdout.
enum class SummaryOutput { kTable, kJson, kNone };

struct RunOptions {
  std::filesystem::path experiment;          // the file, or the folder of a planned sweep
  std::optional<std::filesystem::path> out;  // out/<experiment.name>
  std::optional<int> trials;
  int jobs = 0;  // 0: one a processor
  std::vector<std::string> set;
  std::vector<std::string> only;  // KEY=VALUE of an axis: these cells alone
  bool fresh = false;             // discard what the folder holds
  SummaryOutput output = SummaryOutput::kTable;
  Launcher launcher = Launcher::kProcesses;
  std::optional<Shard> shard;  // this one alone, to be merged
  std::string partition;       // of Slurm; its default where empty
  std::optional<int> shards;   // of Slurm, at most
};
int run(const RunOptions& options);

struct PlanOptions {
  std::filesystem::path experiment;
  std::optional<std::filesystem::path> out;  // out/<experiment.name>
  std::optional<int> trials;
  std::vector<std::string> set;
  std::vector<std::string> only;
  bool dry_run = false;  // writes nothing; runs a trial or two and says how long all will take
  int jobs = 0;          // of that estimate; 0: one a processor
};
int plan(const PlanOptions& options);

struct StatusOptions {
  std::filesystem::path out;
  bool json = false;
};
int status(const StatusOptions& options);

struct MergeOptions {
  std::filesystem::path out;
  bool json = false;
  bool wait = false;  // until no one else writes to the folder
};
int merge(const MergeOptions& options);  // kExitInternal where runs are missing

enum class ReportFormat { kHtml, kMd };
inline constexpr std::array<std::string_view, 2> kReportFormatNames = {"html", "md"};

struct ReportOptions {
  std::filesystem::path results;  // the folder of a sweep
  ReportFormat format = ReportFormat::kHtml;
  std::optional<std::filesystem::path> out;  // RESULTS/report.html; Markdown goes to stdout
};
int report(const ReportOptions& options);

struct SimulateOptions {
  std::filesystem::path scenario;
  std::filesystem::path out;
  std::uint64_t seed = 1;
  std::uint64_t trial = 0;
  std::vector<std::string> set;
  bool plot = false;  // pictures into plots/ of the dataset
};
int simulate(const SimulateOptions& options);

struct EstimateOptions {
  std::filesystem::path dataset;
  std::optional<std::filesystem::path> estimator;  // the defaults where absent
  std::filesystem::path out;
  std::vector<std::string> set;
};
int estimate(const EstimateOptions& options);

struct EvaluateOptions {
  std::filesystem::path estimate;  // of a run, or a folder of many (tools/trajectory_files.h)
  std::filesystem::path truth;
  eval::Alignment alignment = eval::Alignment::kPosyaw;
  int first_n = 0;
  double first_s = 0.0;
  std::string deltas{eval::kDefaultDeltas};  // of the relative errors
  // Of one file (tools/trajectory_files.h).
  std::optional<std::filesystem::path> deviations;
  std::optional<double> td_s;
  bool json = false;
};
int evaluate(const EvaluateOptions& options);

struct CompareOptions {
  std::filesystem::path a;  // folders of results
  std::filesystem::path b;
  std::vector<std::string> metrics;  // all of tables where empty
  double alpha = 0.05;
  bool json = false;
};
int compare(const CompareOptions& options);  // kExitWorse where B is significantly worse

struct NightlyOptions {
  std::filesystem::path suite;
  std::filesystem::path history;
  std::string baseline = "last_green";       // or a tag, or the beginning of a commit
  std::string tag;                           // for this night
  std::optional<std::filesystem::path> out;  // out/nightly/DATE_TIME
  std::optional<std::uint64_t> fresh_seed;   // the time
  std::vector<std::string> set;              // on top of every experiment: what would the gates say to this?
  bool across_scenarios = false;             // compares also what was measured in another scenario
  bool quick = false;
  int jobs = 0;
};
int nightly(const NightlyOptions& options);  // kExitWorse where a gate is red, kExitInternal where runs were lost

enum class ResultsFormat { kCsv, kSqlite };
inline constexpr std::array<std::string_view, 2> kResultsFormatNames = {"csv", "sqlite"};

struct ExportResultsOptions {
  std::filesystem::path results;  // the folder of a run
  ResultsFormat format = ResultsFormat::kCsv;
  std::filesystem::path out;  // a file, which is replaced
};
int export_results(const ExportResultsOptions& options);

enum class ExportFormat { kTum, kEuroc, kKalibr, kOpenvins, kVins, kCsv };
inline constexpr std::array<std::string_view, 6> kExportFormatNames = {"tum",      "euroc", "kalibr",
                                                                       "openvins", "vins",  "csv"};

struct ExportOptions {
  std::filesystem::path dataset;
  ExportFormat format = ExportFormat::kTum;
  std::filesystem::path out;
};
int export_dataset(const ExportOptions& options);

struct ImportOptions {
  std::vector<std::filesystem::path> files;  // rigs (tools/rig.h) and pose files
  std::filesystem::path out;
  std::optional<double> imu_rate_hz;   // of files that do not state it
  std::optional<double> pose_rate_hz;  // of KITTI's poses
};
int import_rig(const ImportOptions& options);

struct ReplayOptions {
  std::filesystem::path results;              // the folder of a sweep
  std::vector<std::string> run;               // its id, or its cell and trial
  std::optional<std::filesystem::path> dump;  // writes the dataset, the estimate and the series
};
int replay(const ReplayOptions& options);  // kExitInternal where the row or the series is not the stored one

struct CheckOptions {
  std::vector<std::filesystem::path> files;
  std::vector<std::string> set;
  bool keys = false;  // print the table of all keys
};
int check(const CheckOptions& options);

// The table of all keys as Markdown, which stands in configs/README.md.
std::string key_table();

}  // namespace plumbline::tools
