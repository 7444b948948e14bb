// Kalibr, and OpenVINS, which took its layout over.
#include <array>
#include <cmath>

#include "foreign_yaml.h"
#include "rig_formats.h"

namespace plumbline::tools::rig_formats {
namespace {

using core::ConfigTree;

std::string_view distortion_name(const core::PinholeCamera& camera) {
  return camera.distortion.model() == core::DistortionModel::kEquidistant ? "equidistant" : "radtan";
}

// All of cam0 but its extrinsics and time.
std::string kalibr_camera_text(const core::PinholeCamera& c) {
  return fmt::format(
      "  camera_model: pinhole\n  distortion_coeffs: {}\n  distortion_model: {}\n"
      "  intrinsics: {}  # fu, fv, pu, pv\n  resolution: [{}, {}]\n  rostopic: /cam0/image_raw\n",
      list(c.distortion.coefficients()), distortion_name(c), list(std::array{c.fx_px, c.fy_px, c.cx_px, c.cy_px}),
      c.width_px, c.height_px);
}

std::string kalibr_matrix_text(std::string_view key, const core::Pose& T) {
  std::string text = fmt::format("  {}:\n", key);
  for (const std::string& row : rows_of(T)) text += fmt::format("    - {}\n", row);
  return text;
}

int whole(const ConfigTree& cam, std::string_view key, double value) {
  if (value != std::floor(value) || value < 1.0 || value > 1e5) {
    throw core::config_error(foreign::at(cam, key).origin, key, "must hold whole numbers of pixels");
  }
  return static_cast<int>(value);
}

core::Distortion parse_distortion(const ConfigTree& cam, std::string_view coefficients_key) {
  const std::string model = foreign::word(cam, "distortion_model");
  if (model == "none") return {};
  const std::vector<double> k = foreign::numbers(cam, coefficients_key, 4);
  const std::array<double, 4> coefficients = {k[0], k[1], k[2], k[3]};
  if (model == "equidistant") return {core::DistortionModel::kEquidistant, coefficients};
  if (model == "radtan" || model == "radial-tangential") {
    if (coefficients == std::array<double, 4>{}) return {};
    return {core::DistortionModel::kRadtan, coefficients};
  }
  throw core::config_error(foreign::at(cam, "distortion_model").origin, "distortion_model",
                           fmt::format("'{}' is not known here; radtan, equidistant or none", model));
}

}  // namespace

Eigen::Matrix3d rotation_matrix(const Eigen::Quaterniond& q) {
  return q.cast<long double>().normalized().toRotationMatrix().cast<double>();
}

std::vector<std::string> rows_of(const core::Pose& T) {
  Eigen::Matrix<double, 4, 4, Eigen::RowMajor> M = Eigen::Matrix4d::Identity();
  M.topLeftCorner<3, 3>() = rotation_matrix(T.q);
  M.topRightCorner<3, 1>() = T.p;
  std::vector<std::string> rows;
  rows.reserve(4);
  for (Eigen::Index r = 0; r < 4; ++r) {
    const double* const row = M.data() + 4 * r;
    rows.push_back(fmt::format("[{}]", fmt::join(row, row + 4, ", ")));
  }
  return rows;
}

std::string densities_text(const core::ImuNoise& noise, std::string_view indent) {
  return fmt::format(
      "{0}accelerometer_noise_density: {1}  # m/s^2/sqrt(Hz), continuous time\n"
      "{0}accelerometer_random_walk: {2}  # m/s^3/sqrt(Hz)\n"
      "{0}gyroscope_noise_density: {3}  # rad/s/sqrt(Hz)\n"
      "{0}gyroscope_random_walk: {4}  # rad/s^2/sqrt(Hz)\n",
      indent, noise.accel_noise_density, noise.accel_bias_walk, noise.gyro_noise_density, noise.gyro_bias_walk);
}

core::ImuNoise parse_densities(const ConfigTree& tree) {
  return {.gyro_noise_density = foreign::number(tree, "gyroscope_noise_density"),
          .gyro_bias_walk = foreign::number(tree, "gyroscope_random_walk"),
          .accel_noise_density = foreign::number(tree, "accelerometer_noise_density"),
          .accel_bias_walk = foreign::number(tree, "accelerometer_random_walk")};
}

core::PinholeCamera parse_pinhole(const ConfigTree& cam, std::string_view coefficients_key) {
  if (foreign::word(cam, "camera_model") != "pinhole") {
    throw core::config_error(foreign::at(cam, "camera_model").origin, "camera_model", "must be pinhole");
  }
  const std::vector<double> size = foreign::numbers(cam, "resolution", 2);
  const std::vector<double> f = foreign::numbers(cam, "intrinsics", 4);
  return {.width_px = whole(cam, "resolution", size[0]),
          .height_px = whole(cam, "resolution", size[1]),
          .fx_px = f[0],
          .fy_px = f[1],
          .cx_px = f[2],
          .cy_px = f[3],
          .distortion = parse_distortion(cam, coefficients_key)};
}

core::RigCalibration parse_timing(const ConfigTree& cam, const core::Pose& T_B_C, int rows) {
  const double readout_s = foreign::maybe_number(cam, "line_delay").value_or(0.0) * rows;
  core::RowReference reference = core::RowReference::kFirst;
  if (const ConfigTree* row = core::find_value(cam, "timeshift_reference_row")) {
    if (row->scalar != "first" && row->scalar != "middle") {
      throw core::config_error(row->origin, "timeshift_reference_row", "must be first or middle");
    }
    if (row->scalar == "middle") reference = core::RowReference::kMiddle;
  }
  const double td_s = foreign::maybe_number(cam, "timeshift_cam_imu").value_or(0.0);
  return {.T_B_C = T_B_C, .td_s = core::td_middle_from(td_s, readout_s, reference), .readout_s = readout_s};
}

double td_first_row(const core::RigCalibration& calibration) { return calibration.td_s - 0.5 * calibration.readout_s; }

std::string line_delay_text(const core::RigCalibration& calibration, int rows, std::string_view indent) {
  if (calibration.readout_s == 0.0) return "";
  return fmt::format("{}line_delay: {}  # s from row to row: readout / rows\n", indent, calibration.readout_s / rows);
}

std::vector<TextFile> kalibr_files(const Rig& rig) {
  const core::RigCalibration& c = rig.calibration;
  const std::string chain = fmt::format(
      "# As Kalibr has it: T_cam_imu takes IMU coordinates to the camera, the inverse of T_B_C;\n"
      "# t_imu = t_cam + timeshift_cam_imu, of the first row: td of the middle row, {} s, less half the readout.\n"
      "cam0:\n{}{}{}  timeshift_cam_imu: {}\n",
      c.td_s, kalibr_matrix_text("T_cam_imu", c.T_B_C.inverse()), kalibr_camera_text(rig.camera),
      line_delay_text(c, rig.camera.height_px, "  "), td_first_row(c));
  const std::string imu = fmt::format(
      "# As Kalibr has it: densities of continuous time; a sample's noise is density * sqrt(update_rate).\n"
      "rostopic: /imu0\nupdate_rate: {}\n{}",
      rig.imu_rate_hz, densities_text(rig.imu_noise, ""));
  return {{"camchain-imucam.yaml", chain}, {"imu.yaml", imu}};
}

std::vector<TextFile> openvins_files(const Rig& rig) {
  const core::RigCalibration& c = rig.calibration;
  const std::string chain = fmt::format(
      "%YAML:1.0\n\n# T_imu_cam takes camera coordinates to the IMU: T_B_C itself.\n"
      "# t_imu = t_cam + timeshift_cam_imu. OpenVINS takes all rows for exposed at once, so it is that of the middle "
      "row;\n"
      "# line_delay and timeshift_reference_row it does not read.\n"
      "cam0:\n{}  cam_overlaps: []\n{}{}  timeshift_cam_imu: {}\n  timeshift_reference_row: middle\n",
      kalibr_matrix_text("T_imu_cam", c.T_B_C), kalibr_camera_text(rig.camera),
      line_delay_text(c, rig.camera.height_px, "  "), c.td_s);
  const std::string imu = fmt::format(
      "%YAML:1.0\n\n# Densities of continuous time, as in Kalibr.\nimu0:\n{}{}  model: kalibr\n"
      "  rostopic: /imu0\n  time_offset: 0.0\n  update_rate: {}\n",
      kalibr_matrix_text("T_i_b", {}), densities_text(rig.imu_noise, "  "), rig.imu_rate_hz);
  const std::string estimator = fmt::format(
      "%YAML:1.0\n\n# What the recording decides, to be merged into a stock estimator_config.yaml.\n"
      "use_stereo: false\nmax_cameras: 1\ncalib_cam_extrinsics: true\ncalib_cam_timeoffset: true\n"
      "gravity_mag: {}\nup_msckf_sigma_px: {}\nup_slam_sigma_px: {}\n"
      "relative_config_imu: \"kalibr_imu_chain.yaml\"\nrelative_config_imucam: \"kalibr_imucam_chain.yaml\"\n",
      rig.gravity_m_s2, rig.pixel_sigma_px, rig.pixel_sigma_px);
  return {{"kalibr_imucam_chain.yaml", chain}, {"kalibr_imu_chain.yaml", imu}, {"estimator_config.yaml", estimator}};
}

void read_camchain(const ConfigTree& tree, PartialRig& rig) {
  const ConfigTree& cam = foreign::at(tree, "cam0");
  const core::PinholeCamera camera = parse_pinhole(cam, "distortion_coeffs");
  set_once(rig.camera, camera, tree, "the camera");
  std::optional<core::Pose> T_B_C;
  if (core::find_value(cam, "T_imu_cam") != nullptr) {
    T_B_C = foreign::transform(cam, "T_imu_cam");
  } else if (core::find_value(cam, "T_cam_imu") != nullptr) {
    T_B_C = foreign::transform(cam, "T_cam_imu").inverse();
  }
  if (T_B_C) set_once(rig.calibration, parse_timing(cam, *T_B_C, camera.height_px), tree, "the extrinsics");
}

void read_imu(const ConfigTree& tree, PartialRig& rig) {
  const ConfigTree* imu0 = core::find_value(tree, "imu0");
  const ConfigTree& imu = imu0 != nullptr ? *imu0 : tree;
  if (foreign::maybe_number(imu, "time_offset").value_or(0.0) != 0.0) {
    throw core::config_error(foreign::at(imu, "time_offset").origin, "time_offset",
                             "must be 0: the IMU's clock is the one that td is of");
  }
  set_once(rig.imu_noise, parse_densities(imu), tree, "the IMU's noise");
  set_once(rig.imu_rate_hz, foreign::number(imu, "update_rate"), tree, "the IMU's rate");
}

void read_openvins(const ConfigTree& tree, const std::filesystem::path& folder, PartialRig& rig) {
  if (const auto gravity = foreign::maybe_number(tree, "gravity_mag")) {
    set_once(rig.gravity_m_s2, *gravity, tree, "gravity");
  }
  if (const auto sigma = foreign::maybe_number(tree, "up_msckf_sigma_px")) {
    set_once(rig.pixel_sigma_px, *sigma, tree, "the pixels' noise");
  }
  read_imu(foreign::load(folder / foreign::word(tree, "relative_config_imu")), rig);
  read_camchain(foreign::load(folder / foreign::word(tree, "relative_config_imucam")), rig);
}

}  // namespace plumbline::tools::rig_formats
