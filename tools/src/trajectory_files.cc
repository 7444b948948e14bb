#include "tools/trajectory_files.h"

#include <algorithm>
#include <array>

#include <fmt/format.h>

#include "core/error.h"
#include "core/pose_formats.h"
#include "openvins_states.h"
#include "sim/truth_files.h"
#include "tools/stated_estimate.h"

namespace plumbline::tools {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kEstimateFile = "estimate.tum";
constexpr std::array<std::string_view, 3> kEndings = {".tum", ".txt", ".csv"};

bool is_pose_file(const fs::path& path) {
  return fs::is_regular_file(path) &&
         std::find(kEndings.begin(), kEndings.end(), path.extension().string()) != kEndings.end();
}

bool is_dataset(const fs::path& path) { return fs::is_directory(path / "truth"); }

void move_to_imu_clock(double td_s, EstimatedTrajectory& estimate) {
  estimate.stamp_clock = "camera";
  estimate.td_s = td_s;
  for (core::StampedPose& pose : estimate.poses) pose.t_ns += core::to_ns(td_s);
}

EstimatedTrajectory read_file(const fs::path& file, const EstimateHints& hints) {
  EstimatedTrajectory estimate;
  if (is_openvins_states(file)) {
    OpenvinsStates states = read_openvins_states(file);
    if (hints.deviations) add_openvins_deviations(*hints.deviations, states);
    estimate.poses = std::move(states.poses);
    estimate.covariances = std::move(states.covariances);
    estimate.stamp_clock = "imu";
    estimate.td = states.td.back();
    estimate.td_history = std::move(states.td);
    return estimate;
  }
  if (hints.deviations) {
    throw core::DataError(file.generic_string() + ": holds no states of OpenVINS, as --std asks for");
  }
  core::PoseFile poses = core::read_poses(file, {.allow_unusable = true});
  estimate.poses = std::move(poses.poses);
  if (poses.format == core::PoseFormat::kTum) estimate.covariances = core::read_tum_covariances(file);
  return estimate;
}

EstimatedTrajectory read_folder(const fs::path& folder) {
  EstimatedTrajectory estimate = read_file(folder / kEstimateFile, {});
  if (!fs::exists(folder / "meta.yaml")) return estimate;
  const EstimateMeta meta = read_estimate_meta(folder / "meta.yaml");
  estimate.stamp_clock = meta.stamp_clock;
  if (meta.stamp_clock == "camera") move_to_imu_clock(meta.td_s.value_or(0.0), estimate);
  if (meta.td_s && meta.td_reference_row) {
    estimate.td = {.t_ns = estimate.poses.back().t_ns,
                   .td_s = core::td_middle_from(*meta.td_s, meta.readout_s.value_or(0.0), *meta.td_reference_row),
                   .sigma_s = meta.td_sigma_s.value_or(0.0)};
    if (fs::exists(folder / "td.csv")) estimate.td_history = read_td_history(folder / "td.csv", meta);
  }
  return estimate;
}

}  // namespace

EstimatedTrajectory read_estimate(const fs::path& path, const EstimateHints& hints) {
  EstimatedTrajectory estimate = fs::is_directory(path) ? read_folder(path) : read_file(path, hints);
  if (hints.td_s) {
    estimate.td = {.t_ns = estimate.poses.back().t_ns, .td_s = *hints.td_s, .sigma_s = 0.0};
    move_to_imu_clock(*hints.td_s, estimate);
  }
  return estimate;
}

TrueTrajectory read_true_trajectory(const fs::path& path) {
  if (!fs::is_directory(path)) return {.poses = core::read_poses(path).poses, .td_s = std::nullopt};
  const sim::GroundTruth truth = sim::read_truth(path);
  TrueTrajectory trajectory{.poses = {}, .td_s = truth.calibration.td_s};
  for (const core::StampedState& s : truth.states) trajectory.poses.push_back({s.t_ns, s.state.T_W_B});
  return trajectory;
}

std::vector<EstimatedRun> list_estimates(const fs::path& folder) {
  std::vector<EstimatedRun> runs;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    const fs::path& path = entry.path();
    if (fs::exists(path / kEstimateFile)) {
      runs.push_back({path.filename().string(), path});
    } else if (is_pose_file(path)) {
      runs.push_back({path.stem().string(), path});
    }
  }
  if (runs.empty()) {
    throw core::DataError(fmt::format("{}: holds no {}, no folder with one and no pose file (.tum, .txt, .csv)",
                                      folder.generic_string(), kEstimateFile));
  }
  std::sort(runs.begin(), runs.end(), [](const EstimatedRun& a, const EstimatedRun& b) { return a.name < b.name; });
  const auto twice = std::adjacent_find(runs.begin(), runs.end(),
                                        [](const EstimatedRun& a, const EstimatedRun& b) { return a.name == b.name; });
  if (twice != runs.end()) {
    throw core::DataError(fmt::format("{}: two estimates are named '{}'", folder.generic_string(), twice->name));
  }
  return runs;
}

fs::path truth_of(const EstimatedRun& run, const fs::path& truth) {
  if (!fs::is_directory(truth) || is_dataset(truth)) return truth;
  for (const std::string_view ending : kEndings) {
    const fs::path file = truth / (run.name + std::string(ending));
    if (fs::exists(file)) return file;
  }
  if (is_dataset(truth / run.name)) return truth / run.name;
  throw core::DataError(fmt::format("{}: is no dataset with its truth and holds none for '{}': no {}.tum, .txt, .csv",
                                    truth.generic_string(), run.name, run.name));
}

}  // namespace plumbline::tools
