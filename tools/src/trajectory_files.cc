#include "tools/trajectory_files.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

#include <fmt/format.h>

#include "core/config_tree.h"
#include "core/error.h"
#include "core/pose_formats.h"
#include "sim/truth_files.h"

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

double number(const core::ConfigTree& value, std::string_view key) {
  double x = 0.0;
  const std::string& text = value.scalar;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), x);
  if (value.kind != core::ConfigTree::Kind::kScalar || error != std::errc() || end != text.data() + text.size() ||
      !std::isfinite(x)) {
    throw core::config_error(value.origin, key, "must be a number");
  }
  return x;
}

// Reads the clock from meta.yaml and moves the stamps to the IMU's.
void apply_clock(const fs::path& meta, EstimatedTrajectory& estimate) {
  const core::ConfigTree tree = core::load_config_file(meta);
  const core::ConfigTree* clock = core::find_value(tree, "stamp_clock");
  if (clock == nullptr) throw core::config_error(tree.origin, "stamp_clock", "missing: imu or camera");
  estimate.stamp_clock = clock->scalar;
  if (clock->scalar == "imu") return;
  if (clock->scalar != "camera") throw core::config_error(clock->origin, "stamp_clock", "must be imu or camera");

  const core::ConfigTree* td = core::find_value(tree, "td_s");
  if (td == nullptr) td = core::find_value(tree, "calibration.td_s");
  if (td == nullptr) {
    throw core::config_error(clock->origin, "td_s", "missing: stamps of the camera's clock need the estimated td");
  }
  estimate.td_s = number(*td, "td_s");
  constexpr double kLargest = 3600.0;
  if (std::abs(*estimate.td_s) > kLargest) throw core::config_error(td->origin, "td_s", "must be within an hour");
  for (core::StampedPose& pose : estimate.poses) pose.t_ns += core::to_ns(*estimate.td_s);
}

}  // namespace

EstimatedTrajectory read_estimate(const fs::path& path) {
  const bool folder = fs::is_directory(path);
  const fs::path file = folder ? path / kEstimateFile : path;
  EstimatedTrajectory estimate;
  core::PoseFile poses = core::read_poses(file, {.allow_unusable = true});
  estimate.poses = std::move(poses.poses);
  if (poses.format == core::PoseFormat::kTum) estimate.covariances = core::read_tum_covariances(file);
  if (folder && fs::exists(path / "meta.yaml")) apply_clock(path / "meta.yaml", estimate);
  return estimate;
}

std::vector<core::StampedPose> read_true_poses(const fs::path& path) {
  if (!fs::is_directory(path)) return core::read_poses(path).poses;
  std::vector<core::StampedPose> poses;
  for (const core::StampedState& s : sim::read_truth(path).states) poses.push_back({s.t_ns, s.state.T_W_B});
  return poses;
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
