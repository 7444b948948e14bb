#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "core/atomic_file.h"
#include "core/dataset.h"
#include "core/error.h"
#include "core/pose_formats.h"
#include "sim/scenario.h"
#include "tools/commands.h"
#include "tools/rig.h"

namespace plumbline::tools {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

double reread(const std::string& text) {
  double x = 0.0;
  std::from_chars(text.data(), text.data() + text.size(), x);
  return x + 0.0;  // no -0
}

// What a conversion rounds in the last of 53 bits shows in the 16th digit.
double to_15_digits(double x) { return reread(fmt::format("{:.15g}", x)); }
double to_15_decimals(double x) { return reread(fmt::format("{:.15f}", x)); }

template <class Numbers>
ordered_json rounded_digits(const Numbers& numbers, double (*round)(double)) {
  ordered_json list = ordered_json::array();
  for (const double x : numbers) list.push_back(round(x));
  return list;
}

bool is_pose_file(const fs::path& path) {
  constexpr std::array<std::string_view, 3> kEndings = {".tum", ".txt", ".csv"};
  return std::ranges::find(kEndings, path.extension().string()) != kEndings.end();
}

ordered_json imu_keys(const PartialRig& rig) {
  ordered_json imu = ordered_json::object();
  if (rig.imu_rate_hz) imu["rate_hz"] = to_15_digits(*rig.imu_rate_hz);
  if (rig.imu_noise) {
    imu["gyro_noise_density_rad_s_sqrt_hz"] = to_15_digits(rig.imu_noise->gyro_noise_density);
    imu["gyro_bias_walk_rad_s2_sqrt_hz"] = to_15_digits(rig.imu_noise->gyro_bias_walk);
    imu["accel_noise_density_m_s2_sqrt_hz"] = to_15_digits(rig.imu_noise->accel_noise_density);
    imu["accel_bias_walk_m_s3_sqrt_hz"] = to_15_digits(rig.imu_noise->accel_bias_walk);
  }
  return imu;
}

ordered_json camera_keys(const PartialRig& rig) {
  ordered_json camera = ordered_json::object();
  if (rig.camera_rate_hz) camera["rate_hz"] = to_15_digits(*rig.camera_rate_hz);
  if (rig.camera) {
    const core::PinholeCamera& c = *rig.camera;
    camera["width_px"] = c.width_px;
    camera["height_px"] = c.height_px;
    camera["fx_px"] = c.fx_px;
    camera["fy_px"] = c.fy_px;
    camera["cx_px"] = c.cx_px;
    camera["cy_px"] = c.cy_px;
    camera["distortion"] = core::kDistortionModelNames[static_cast<std::size_t>(c.distortion.model())];
    camera["distortion_coefficients"] = c.distortion.coefficients();
  }
  if (rig.calibration) {
    const core::RigCalibration& c = *rig.calibration;
    camera["td_s"] = to_15_digits(c.td_s);
    camera["td_reference_row"] = "middle";
    camera["readout_s"] = to_15_digits(c.readout_s);
    camera["extrinsic_position_m"] = rounded_digits(c.T_B_C.p, to_15_decimals);
    camera["extrinsic_rotation_xyzw"] = rounded_digits(c.T_B_C.q.coeffs(), to_15_decimals);
  }
  if (rig.pixel_sigma_px) camera["pixel_sigma_px"] = to_15_digits(*rig.pixel_sigma_px);
  return camera;
}

// A spline of the poses, as long as the file.
void add_trajectory(const fs::path& file, const ImportOptions& options, ordered_json& scenario) {
  if (scenario.contains("trajectory")) {
    throw core::DataError(file.generic_string() + ": another file states the trajectory already");
  }
  const std::vector<core::StampedPose> poses =
      core::read_poses(file, {.kitti_rate_hz = options.pose_rate_hz.value_or(0.0)}).poses;
  const double length_s = core::to_seconds(poses.back().t_ns - poses.front().t_ns);
  scenario["duration_s"] = std::min(std::floor(10.0 * length_s) / 10.0, 3600.0);
  const fs::path folder = fs::absolute(options.out).parent_path();
  scenario["trajectory"] = {{"type", "spline"},
                            {"file", fs::absolute(file).lexically_proximate(folder).generic_string()}};
  if (options.pose_rate_hz) scenario["trajectory"]["pose_rate_hz"] = *options.pose_rate_hz;
}

std::string scenario_text(const PartialRig& rig, const ImportOptions& options, const ordered_json& scenario) {
  std::vector<std::string> names;
  names.reserve(options.files.size());
  for (const fs::path& file : options.files) names.push_back(file.filename().generic_string());
  std::string text = fmt::format(
      "# From {}.\n# t_imu = t_cam + td, td of the middle row; T_B_C: the camera in the body, which is the IMU; "
      "densities of\n"
      "# continuous time.",
      fmt::join(names, ", "));
  std::vector<std::string_view> missing;
  if (!rig.camera) missing.emplace_back("lens and picture");
  if (!rig.calibration) missing.emplace_back("td, readout and extrinsics");
  if (!rig.camera_rate_hz) missing.emplace_back("the camera's rate");
  if (!rig.imu_noise) missing.emplace_back("the IMU's noise");
  if (!scenario.contains("trajectory")) missing.emplace_back("trajectory");
  if (!missing.empty()) text += fmt::format(" Not stated there, hence defaults: {}.", fmt::join(missing, ", "));
  return text + '\n' + core::to_yaml(scenario);
}

}  // namespace

int import_rig(const ImportOptions& options) {
  if (fs::exists(options.out)) throw core::DataError(options.out.generic_string() + ": exists already");
  core::require_no_file_above(options.out);
  PartialRig rig;
  ordered_json scenario = ordered_json::object();
  for (const fs::path& file : options.files) {
    if (!fs::exists(file)) throw core::DataError(file.generic_string() + ": no such file or folder");
    if (is_pose_file(file)) {
      add_trajectory(file, options, scenario);
      continue;
    }
    read_rig(file, options.imu_rate_hz, rig);
    const fs::path truth = file / "mav0/state_groundtruth_estimate0/data.csv";
    if (fs::exists(truth)) add_trajectory(truth, options, scenario);
  }
  if (rig.gravity_m_s2) scenario["gravity_m_s2"] = to_15_digits(*rig.gravity_m_s2);
  if (ordered_json imu = imu_keys(rig); !imu.empty()) scenario["imu"] = std::move(imu);
  if (ordered_json camera = camera_keys(rig); !camera.empty()) scenario["camera"] = std::move(camera);

  const std::string text = scenario_text(rig, options, scenario);
  sim::ScenarioConfig config;
  core::read_config(core::parse_config(text, options.out.generic_string()), "", config);
  if (const auto violation = sim::validate(config)) {
    throw core::DataError(
        fmt::format("{}: {}: {}", options.files.front().generic_string(), violation->key, violation->rule));
  }
  core::write_file_atomically(options.out, text);
  fmt::print("{}\n", options.out.generic_string());
  return kExitOk;
}

}  // namespace plumbline::tools
