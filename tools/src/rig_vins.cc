// VINS-Mono and VINS-Fusion. Its noises are those of a sample: density * sqrt(rate), also of the biases, whose step it
// takes as gyr_w * dt.
#include <array>
#include <cmath>

#include "foreign_yaml.h"
#include "rig_formats.h"

namespace plumbline::tools::rig_formats {
namespace {

using core::ConfigTree;

// What a recording does not decide, as in VINS-Mono's own configuration for EuRoC.
constexpr std::string_view kStockText = R"(
max_cnt: 150
min_dist: 30
freq: 10
F_threshold: 1.0
show_track: 0
equalize: 0
fisheye: 0
max_solver_time: 0.04
max_num_iterations: 8
keyframe_parallax: 10.0
loop_closure: 0
load_previous_pose_graph: 0
fast_relocalization: 0
save_image: 0
visualize_imu_forward: 0
visualize_camera_size: 0.4
)";

std::string vins_camera_text(const core::PinholeCamera& c) {
  const std::array<double, 4>& k = c.distortion.coefficients();
  const std::string size = fmt::format("image_width: {}\nimage_height: {}\n", c.width_px, c.height_px);
  if (c.distortion.model() == core::DistortionModel::kEquidistant) {
    return fmt::format(
        "model_type: KANNALA_BRANDT\ncamera_name: camera\n{}projection_parameters:\n"
        "  k2: {}\n  k3: {}\n  k4: {}\n  k5: {}\n  mu: {}\n  mv: {}\n  u0: {}\n  v0: {}\n",
        size, k[0], k[1], k[2], k[3], c.fx_px, c.fy_px, c.cx_px, c.cy_px);
  }
  return fmt::format(
      "model_type: PINHOLE\ncamera_name: camera\n{}distortion_parameters:\n"
      "  k1: {}\n  k2: {}\n  p1: {}\n  p2: {}\nprojection_parameters:\n  fx: {}\n  fy: {}\n  cx: {}\n  cy: {}\n",
      size, k[0], k[1], k[2], k[3], c.fx_px, c.fy_px, c.cx_px, c.cy_px);
}

template <class Matrix>
std::string vins_matrix_text(std::string_view key, const Matrix& M) {
  std::vector<double> data;
  for (int r = 0; r < M.rows(); ++r) {
    for (int c = 0; c < M.cols(); ++c) data.push_back(M(r, c));
  }
  return fmt::format("{}: !!opencv-matrix\n  rows: {}\n  cols: {}\n  dt: d\n  data: {}\n", key, M.rows(), M.cols(),
                     list(data));
}

core::PinholeCamera vins_camera(const ConfigTree& tree) {
  const std::string model = foreign::word(tree, "model_type");
  const bool fisheye = model == "KANNALA_BRANDT";
  if (!fisheye && model != "PINHOLE" && model != "pinhole") {
    throw core::config_error(foreign::at(tree, "model_type").origin, "model_type",
                             fmt::format("'{}' is not known here; PINHOLE or KANNALA_BRANDT", model));
  }
  const auto projection = [&](std::string_view key) {
    return foreign::number(tree, fmt::format("projection_parameters.{}", key));
  };
  const auto distortion = [&](std::string_view key) {
    return foreign::number(tree, fmt::format("distortion_parameters.{}", key));
  };
  core::PinholeCamera camera{.width_px = static_cast<int>(foreign::number(tree, "image_width")),
                             .height_px = static_cast<int>(foreign::number(tree, "image_height")),
                             .fx_px = projection(fisheye ? "mu" : "fx"),
                             .fy_px = projection(fisheye ? "mv" : "fy"),
                             .cx_px = projection(fisheye ? "u0" : "cx"),
                             .cy_px = projection(fisheye ? "v0" : "cy"),
                             .distortion = {}};
  if (fisheye) {
    camera.distortion = {core::DistortionModel::kEquidistant,
                         {projection("k2"), projection("k3"), projection("k4"), projection("k5")}};
    return camera;
  }
  const std::array<double, 4> k = {distortion("k1"), distortion("k2"), distortion("p1"), distortion("p2")};
  if (k != std::array<double, 4>{}) camera.distortion = {core::DistortionModel::kRadtan, k};
  return camera;
}

core::Pose vins_extrinsics(const ConfigTree& tree) {
  if (core::find_value(tree, "body_T_cam0") != nullptr) return foreign::transform(tree, "body_T_cam0");
  const Eigen::Quaterniond q =
      foreign::quaternion(foreign::rotation(tree, "extrinsicRotation"), tree, "extrinsicRotation");
  const std::vector<double> p = foreign::numbers(tree, "extrinsicTranslation", 3);
  return {q, {p[0], p[1], p[2]}};
}

}  // namespace

std::vector<TextFile> vins_files(const Rig& rig) {
  const core::RigCalibration& c = rig.calibration;
  const core::ImuNoise& n = rig.imu_noise;
  const double root = std::sqrt(rig.imu_rate_hz);
  const std::string text = fmt::format(
      "%YAML:1.0\n\nimu_topic: \"/imu0\"\nimage_topic: \"/cam0/image_raw\"\noutput_path: \"/tmp/\"\n\n{}\n"
      "# T_B_C itself, from the camera to the IMU; a guess to be refined.\nestimate_extrinsic: 1\n{}{}\n"
      "# Of a sample: the density of continuous time times sqrt(imu_rate_hz), of the biases too. The two ends of a\n"
      "# midpoint step count as independent there, which is half the variance that a sample's noise adds.\n"
      "# imu_rate_hz is not read by VINS.\n"
      "imu_rate_hz: {}\nacc_n: {}\ngyr_n: {}\nacc_w: {}\ngyr_w: {}\ng_norm: {}\n\n"
      "# t_imu = t_cam + td, of the middle row: VINS counts rows from there.\nestimate_td: 1\ntd: {}\n"
      "rolling_shutter: {}\nrolling_shutter_tr: {}  # s, first row to last\n{}",
      vins_camera_text(rig.camera), vins_matrix_text("extrinsicRotation", rotation_matrix(c.T_B_C.q)),
      vins_matrix_text("extrinsicTranslation", c.T_B_C.p), rig.imu_rate_hz, n.accel_noise_density * root,
      n.gyro_noise_density * root, n.accel_bias_walk * root, n.gyro_bias_walk * root, rig.gravity_m_s2, c.td_s,
      c.readout_s != 0.0 ? 1 : 0, c.readout_s, kStockText);
  return {{"vins_config.yaml", text}};
}

void read_vins(const ConfigTree& tree, const std::filesystem::path& folder, std::optional<double> imu_rate_hz,
               PartialRig& rig) {
  const bool apart = core::find_value(tree, "cam0_calib") != nullptr;
  set_once(rig.camera, vins_camera(apart ? foreign::load(folder / foreign::word(tree, "cam0_calib")) : tree), tree,
           "the camera");
  const bool rolling = foreign::maybe_number(tree, "rolling_shutter").value_or(0.0) != 0.0;
  set_once(rig.calibration,
           {.T_B_C = vins_extrinsics(tree),
            .td_s = foreign::maybe_number(tree, "td").value_or(0.0),
            .readout_s = rolling ? foreign::number(tree, "rolling_shutter_tr") : 0.0},
           tree, "the extrinsics");
  if (const auto gravity = foreign::maybe_number(tree, "g_norm")) set_once(rig.gravity_m_s2, *gravity, tree, "gravity");
  const double rate_hz = imu_rate_hz ? *imu_rate_hz : foreign::maybe_number(tree, "imu_rate_hz").value_or(0.0);
  if (!(rate_hz > 0.0)) {
    throw core::config_error(foreign::at(tree, "acc_n").origin, "acc_n",
                             "is of a sample: give the IMU's rate (--imu-rate HZ)");
  }
  const double root = std::sqrt(rate_hz);
  set_once(rig.imu_rate_hz, rate_hz, tree, "the IMU's rate");
  set_once(rig.imu_noise,
           {.gyro_noise_density = foreign::number(tree, "gyr_n") / root,
            .gyro_bias_walk = foreign::number(tree, "gyr_w") / root,
            .accel_noise_density = foreign::number(tree, "acc_n") / root,
            .accel_bias_walk = foreign::number(tree, "acc_w") / root},
           tree, "the IMU's noise");
}

}  // namespace plumbline::tools::rig_formats
