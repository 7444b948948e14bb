// The sensor.yaml files of EuRoC (ASL), in which a camera's clock is the IMU's; td and line_delay are keys of our own.
#include <array>

#include "foreign_yaml.h"
#include "rig_formats.h"

namespace plumbline::tools::rig_formats {
namespace {

using core::ConfigTree;

std::string euroc_matrix_text(const core::Pose& T) {
  std::string data;
  for (const std::string& row : rows_of(T)) {
    data += fmt::format("{}{}", data.empty() ? "" : ", ", row.substr(1, row.size() - 2));
  }
  return fmt::format("T_BS:\n  cols: 4\n  rows: 4\n  data: [{}]\n", data);
}

}  // namespace

std::vector<TextFile> euroc_files(const Rig& rig) {
  const core::RigCalibration& calibration = rig.calibration;
  const core::PinholeCamera& c = rig.camera;
  const bool fisheye = c.distortion.model() == core::DistortionModel::kEquidistant;
  const std::string camera = fmt::format(
      "# T_BS takes camera coordinates to the body, which is the IMU: T_B_C itself.\nsensor_type: camera\n"
      "comment: simulated\n{}rate_hz: {}\nresolution: [{}, {}]\ncamera_model: pinhole\nintrinsics: {}  # fu, fv, cu, "
      "cv\n"
      "distortion_model: {}\ndistortion_coefficients: {}\n"
      "# Not EuRoC's, whose clocks agree; as in Kalibr: t_imu = t_cam + timeshift_cam_imu, of the first row, which is "
      "td\n"
      "# of the middle row, {} s, less half the readout.\ntimeshift_cam_imu: {}\n{}",
      euroc_matrix_text(calibration.T_B_C), rig.camera_rate_hz, c.width_px, c.height_px,
      list(std::array{c.fx_px, c.fy_px, c.cx_px, c.cy_px}), fisheye ? "equidistant" : "radial-tangential",
      list(c.distortion.coefficients()), calibration.td_s, td_first_row(calibration),
      line_delay_text(calibration, c.height_px, ""));
  const std::string imu =
      fmt::format("# Densities of continuous time.\nsensor_type: imu\ncomment: simulated\n{}rate_hz: {}\n{}",
                  euroc_matrix_text({}), rig.imu_rate_hz, densities_text(rig.imu_noise, ""));
  return {{"mav0/cam0/sensor.yaml", camera}, {"mav0/imu0/sensor.yaml", imu}};
}

void read_euroc_sensor(const ConfigTree& tree, PartialRig& rig) {
  const std::string type = foreign::word(tree, "sensor_type");
  const core::Pose T_B_S = foreign::transform(tree, "T_BS");
  if (type == "camera") {
    const core::PinholeCamera camera = parse_pinhole(tree, "distortion_coefficients");
    set_once(rig.camera, camera, tree, "the camera");
    set_once(rig.camera_rate_hz, foreign::number(tree, "rate_hz"), tree, "the camera's rate");
    set_once(rig.calibration, parse_timing(tree, T_B_S, camera.height_px), tree, "the extrinsics");
  } else if (type == "imu") {
    if (T_B_S.p != Eigen::Vector3d::Zero() || core::rotation_angle(T_B_S.q) > 0.0) {
      throw core::config_error(foreign::at(tree, "T_BS").origin, "T_BS", "must be the identity: the body is the IMU");
    }
    set_once(rig.imu_noise, parse_densities(tree), tree, "the IMU's noise");
    set_once(rig.imu_rate_hz, foreign::number(tree, "rate_hz"), tree, "the IMU's rate");
  } else {
    throw core::config_error(foreign::at(tree, "sensor_type").origin, "sensor_type", "must be camera or imu");
  }
}

}  // namespace plumbline::tools::rig_formats
