#include <algorithm>
#include <map>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "core/error.h"
#include "eval/pose_consistency.h"
#include "eval/statistics.h"
#include "eval/td_convergence.h"
#include "eval/trajectory_error.h"
#include "tools/commands.h"
#include "tools/trajectory_files.h"

namespace plumbline::tools {
namespace {

using nlohmann::ordered_json;

// A run against its truth.
struct Scored {
  std::string name;
  EstimatedTrajectory estimate;
  eval::TrajectoryErrors errors;
  eval::PoseConsistencyResult consistency;
  std::optional<double> td_error_s;    // of the middle row, where both know it
  std::optional<double> td_settled_s;  // since the first pose; nothing where it never did
};

constexpr const char* kAligned = "covariances are compared with --align none only";

Scored score(const EstimatedRun& run, const TrueTrajectory& truth, const EvaluateOptions& options) {
  Scored scored{.name = run.name,
                .estimate = read_estimate(run.path, {.deviations = options.deviations, .td_s = options.td_s}),
                .errors = {},
                .consistency = {},
                .td_error_s = {},
                .td_settled_s = {}};
  if (scored.estimate.td && truth.td_s) {
    scored.td_error_s = scored.estimate.td->td_s - *truth.td_s;
    if (const auto t_ns = eval::td_settles_at(scored.estimate.td_history, *truth.td_s, eval::kTdBoundS)) {
      scored.td_settled_s = core::to_seconds(*t_ns - scored.estimate.poses.front().t_ns);
    }
  }
  scored.errors = eval::trajectory_errors(scored.estimate.poses, truth.poses,
                                          {.alignment = options.alignment,
                                           .first_n = options.first_n,
                                           .first_s = options.first_s,
                                           .deltas = eval::parse_deltas(options.deltas)});
  if (!scored.errors.ok || scored.estimate.covariances.empty()) return scored;
  if (options.alignment == eval::Alignment::kNone) {
    scored.consistency = eval::pose_consistency(scored.errors.pairs, scored.estimate.covariances);
  } else {
    scored.consistency.reason = kAligned;
  }
  return scored;
}

ordered_json to_json(const Scored& scored, const EvaluateOptions& options) {
  ordered_json json = eval::to_json(scored.errors, options.alignment);
  json["stamp_clock"] = scored.estimate.stamp_clock;
  if (scored.estimate.td_s) json["stamps_moved_by_s"] = *scored.estimate.td_s;
  if (const auto& td = scored.estimate.td) {
    json["td"] = {{"estimate_s", td->td_s}};
    if (td->sigma_s > 0.0) json["td"]["sigma_s"] = td->sigma_s;
    if (scored.td_error_s) json["td"]["error_s"] = *scored.td_error_s;
    if (scored.td_error_s && !scored.estimate.td_history.empty()) {
      json["td"]["convergence_s"] = scored.td_settled_s ? ordered_json(*scored.td_settled_s) : ordered_json(nullptr);
    }
  }
  if (scored.consistency.consistency) json["consistency"] = eval::to_json(*scored.consistency.consistency);
  if (!scored.consistency.reason.empty()) json["no_consistency"] = scored.consistency.reason;
  return json;
}

void print_relative(const std::vector<eval::RelativeErrors>& relative) {
  if (relative.empty()) return;
  fmt::print("\n{:<22}{:>12}{:>12}{:>12}{:>12}{:>12}\n", "relative error, rmse", "pairs", "[m]", "[deg]", "yaw",
             "gravity");
  for (const eval::RelativeErrors& r : relative) {
    if (r.pairs == 0) {
      fmt::print("{:<22}{:>12}\n", eval::to_string(r.delta), "none");
      continue;
    }
    fmt::print("{:<22}{:>12}{:>12.6f}{:>12.6f}{:>12.6f}{:>12.6f}\n", eval::to_string(r.delta), r.pairs,
               r.position_m.rmse, r.rotation_deg.rmse, r.yaw_deg.rmse, r.gravity_deg.rmse);
  }
}

void print_axes(const Scored& scored) {
  const eval::TrajectoryErrors& e = scored.errors;
  const auto& consistency = scored.consistency.consistency;
  fmt::print("\n{:<22}{:>12}{:>12}{}\n", "axis", "mean", "rmse", consistency ? "  in 3 sigma" : "");
  for (int i = 0; i < 6; ++i) {
    const bool position = i < 3;
    const eval::AxisStatistics& axes = position ? e.position_axes_m : e.rotation_axes_deg;
    const std::string share = consistency ? fmt::format("{:>10.1f} %", 100.0 * consistency->within_3_sigma(i)) : "";
    fmt::print("{:<22}{:>12.6f}{:>12.6f}{}\n",
               fmt::format("{} {}", position ? "position [m]" : "rotation [deg]", "xyz"[i % 3]), axes.mean(i % 3),
               axes.rmse(i % 3), share);
  }
  if (consistency) {
    fmt::print("\nmean NEES: pose {:.3f} (6), position {:.3f} (3), orientation {:.3f} (3)\n", consistency->nees_pose,
               consistency->nees_position, consistency->nees_orientation);
  }
  if (!scored.consistency.reason.empty()) fmt::print("\nno consistency: {}\n", scored.consistency.reason);
}

void print_run(const Scored& scored, const EvaluateOptions& options) {
  const eval::TrajectoryErrors& e = scored.errors;
  if (!e.ok) {
    fmt::print("failed run: {}\n", e.reason);
    return;
  }
  fmt::print("alignment {}, {} poses matched, coverage {:.1f} %, truth {}, stamps: {}{}\n",
             eval::kAlignmentNames[static_cast<std::size_t>(options.alignment)], e.matched, 100.0 * e.coverage,
             e.interpolated > 0 ? fmt::format("interpolated over up to {:.4g} s", e.largest_bridged_s) : "exact",
             scored.estimate.stamp_clock,
             scored.estimate.td_s ? fmt::format(" moved by {:.6f} s", *scored.estimate.td_s) : "");
  fmt::print("\n{:<22}{:>12}{:>12}{:>12}{:>12}{:>12}{:>12}\n", "", "rmse", "mean", "median", "std", "min", "max");
  const auto line = [](const char* name, const eval::ErrorStatistics& s) {
    fmt::print("{:<22}{:>12.6f}{:>12.6f}{:>12.6f}{:>12.6f}{:>12.6f}{:>12.6f}\n", name, s.rmse, s.mean, s.median, s.std,
               s.min, s.max);
  };
  line("ATE position [m]", e.position_m);
  line("ATE rotation [deg]", e.rotation_deg);
  line("ATE yaw [deg]", e.yaw_deg);
  line("ATE gravity [deg]", e.gravity_deg);
  if (const auto& td = scored.estimate.td) {
    fmt::print("\ntd {:.6f} ms{}{}, middle row\n", 1e3 * td->td_s,
               td->sigma_s > 0.0 ? fmt::format(" (sigma {:.6f})", 1e3 * td->sigma_s) : "",
               scored.td_error_s ? fmt::format(", error {:.6f} ms", 1e3 * *scored.td_error_s) : "");
    if (scored.td_error_s && !scored.estimate.td_history.empty()) {
      fmt::print("td within {:g} ms for good: {}\n", 1e3 * eval::kTdBoundS,
                 scored.td_settled_s ? fmt::format("after {:.3f} s", *scored.td_settled_s) : "never");
    }
  }
  print_axes(scored);
  print_relative(e.relative);
}

// A row a run, and what they make together.
class RunTable {
 public:
  explicit RunTable(std::size_t name_width) : width_(static_cast<int>(name_width)) {
    fmt::print("{:<{}}{:>8}{:>10}{:>14}{:>12}{:>12}{:>13}\n", "run", width_ + 2, "poses", "coverage", "position [m]",
               "rot. [deg]", "yaw [deg]", "grav. [deg]");
  }

  void add(const Scored& scored) {
    const eval::TrajectoryErrors& e = scored.errors;
    fmt::print("{:<{}}", scored.name, width_ + 2);
    if (!e.ok) {
      fmt::print("  failed: {}\n", e.reason);
      return;
    }
    fmt::print("{:>8}{:>8.1f} %{:>14.6f}{:>12.6f}{:>12.6f}{:>13.6f}\n", e.matched, 100.0 * e.coverage,
               e.position_m.rmse, e.rotation_deg.rmse, e.yaw_deg.rmse, e.gravity_deg.rmse);
    position_m_.push_back(e.position_m.rmse);
    rotation_deg_.push_back(e.rotation_deg.rmse);
  }

  void finish(std::size_t n) const {
    fmt::print("\n{}/{} ok\n", position_m_.size(), n);
    if (position_m_.empty()) return;
    const auto line = [](const char* name, const std::vector<double>& values) {
      const auto interval = eval::rms_interval(values, eval::kConfidence);
      fmt::print("{}: median {:.6f}, rmse over runs {:.6f}{}\n", name, eval::median(values),
                 eval::root_mean_square(values),
                 interval ? fmt::format(" [{:.6f}, {:.6f}] (95 %)", interval->lo, interval->hi) : "");
    };
    line("ATE position [m]", position_m_);
    line("ATE rotation [deg]", rotation_deg_);
  }

 private:
  int width_;
  std::vector<double> position_m_;
  std::vector<double> rotation_deg_;
};

int evaluate_one(const EvaluateOptions& options) {
  const EstimatedRun run{.name = options.estimate.stem().string(), .path = options.estimate};
  const Scored scored = score(run, read_true_trajectory(truth_of(run, options.truth)), options);
  if (options.json) {
    fmt::print("{}\n", to_json(scored, options).dump(2));
  } else {
    print_run(scored, options);
  }
  return scored.errors.ok ? kExitOk : kExitWorse;
}

int evaluate_folder(const EvaluateOptions& options) {
  const std::vector<EstimatedRun> runs = list_estimates(options.estimate);
  // All is read before the first line is printed: unreadable input leaves no half a table.
  std::map<std::filesystem::path, TrueTrajectory> truths;
  std::vector<Scored> all;
  std::size_t width = 3;
  for (const EstimatedRun& run : runs) {
    const std::filesystem::path truth = truth_of(run, options.truth);
    if (!truths.contains(truth)) truths.emplace(truth, read_true_trajectory(truth));
    all.push_back(score(run, truths.at(truth), options));
    width = std::max(width, run.name.size());
  }
  const auto n_ok = std::count_if(all.begin(), all.end(), [](const Scored& s) { return s.errors.ok; });
  if (options.json) {
    ordered_json json = {{"alignment", eval::kAlignmentNames[static_cast<std::size_t>(options.alignment)]},
                         {"n", all.size()},
                         {"n_ok", n_ok},
                         {"runs", ordered_json::array()}};
    for (const Scored& scored : all) {
      ordered_json row = {{"name", scored.name}};
      row.update(to_json(scored, options));
      json["runs"].push_back(std::move(row));
    }
    fmt::print("{}\n", json.dump(2));
  } else {
    RunTable table(width);
    for (const Scored& scored : all) table.add(scored);
    table.finish(all.size());
  }
  return n_ok == std::ssize(all) ? kExitOk : kExitWorse;
}

}  // namespace

int evaluate(const EvaluateOptions& options) {
  const bool many =
      std::filesystem::is_directory(options.estimate) && !std::filesystem::exists(options.estimate / "estimate.tum");
  if (many && (options.deviations || options.td_s)) {
    throw core::DataError(options.estimate.generic_string() + ": --std and --td are of one estimate");
  }
  return many ? evaluate_folder(options) : evaluate_one(options);
}

}  // namespace plumbline::tools
