// Rigs and trajectories to and from the files of Kalibr, OpenVINS, VINS and EuRoC.
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "core/pose_file.h"
#include "program_test.h"
#include "sim/truth_files.h"
#include "tools/experiment.h"

namespace plumbline {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using ::testing::HasSubstr;

class Interoperability : public ProgramTest {
 protected:
  // A dataset of a rig all of whose numbers are decimals; what its estimator is told is the truth.
  void simulate(const std::string& lens) const {
    write("scenario.yaml", R"(duration_s: 2
gravity_m_s2: 9.80665
imu: {rate_hz: 250, gyro_noise_density_rad_s_sqrt_hz: 1.7e-4, gyro_bias_walk_rad_s2_sqrt_hz: 2.3e-5,
      accel_noise_density_m_s2_sqrt_hz: 2.1e-3, accel_bias_walk_m_s3_sqrt_hz: 3.7e-4}
camera: {rate_hz: 20, width_px: 752, height_px: 478, fx_px: 458.654, fy_px: 457.296, cx_px: 367.215, cy_px: 248.375,
         td_s: 0.0123, readout_s: 0.0271, pixel_sigma_px: 0.7, extrinsic_position_m: [0.0613, -0.0217, 0.0098],
         extrinsic_rotation_xyzw: [-0.46, 0.54, -0.54, 0.452990066116245], )" +
                               lens + R"(}
world: {landmarks: 50}
points: {per_frame: 5}
prior: {means: truth}
)");
    fs::remove_all(folder_ / "data");
    ASSERT_EQ(plumbline("simulate scenario.yaml --out data").code, 0);
  }

  sim::ScenarioConfig scenario(const std::string& file) const { return tools::load_scenario(folder_ / file, {}); }

  // Of `name: NUMBER` in a file.
  double number_in(const std::string& file, const std::string& name) const {
    const std::string text = read(folder_ / file);
    const std::size_t at = text.find("\n" + name + ": ");
    if (at == std::string::npos) throw std::runtime_error(file + " has no " + name);
    return std::stod(text.substr(at + name.size() + 3));
  }
};

struct RoundTrip {
  std::string format;
  std::string files;
};

void expect_same_rig(const sim::ScenarioConfig& a, const sim::ScenarioConfig& b, const std::string& format) {
  EXPECT_EQ(a.camera.td_s, b.camera.td_s) << format;
  EXPECT_EQ(a.camera.td_reference_row, b.camera.td_reference_row) << format;
  EXPECT_EQ(a.camera.readout_s, b.camera.readout_s) << format;
  EXPECT_EQ(a.camera.extrinsic_position_m, b.camera.extrinsic_position_m) << format;
  EXPECT_EQ(a.camera.extrinsic_rotation_xyzw, b.camera.extrinsic_rotation_xyzw) << format;
  const core::PinholeCamera& c = a.camera.model;
  const core::PinholeCamera& d = b.camera.model;
  EXPECT_EQ(c.width_px, d.width_px) << format;
  EXPECT_EQ(c.height_px, d.height_px) << format;
  EXPECT_EQ(c.fx_px, d.fx_px) << format;
  EXPECT_EQ(c.fy_px, d.fy_px) << format;
  EXPECT_EQ(c.cx_px, d.cx_px) << format;
  EXPECT_EQ(c.cy_px, d.cy_px) << format;
  EXPECT_EQ(c.distortion.model(), d.distortion.model()) << format;
  EXPECT_EQ(c.distortion.coefficients(), d.distortion.coefficients()) << format;
  EXPECT_EQ(a.imu.rate_hz, b.imu.rate_hz) << format;
  EXPECT_EQ(a.imu.noise.gyro_noise_density, b.imu.noise.gyro_noise_density) << format;
  EXPECT_EQ(a.imu.noise.gyro_bias_walk, b.imu.noise.gyro_bias_walk) << format;
  EXPECT_EQ(a.imu.noise.accel_noise_density, b.imu.noise.accel_noise_density) << format;
  EXPECT_EQ(a.imu.noise.accel_bias_walk, b.imu.noise.accel_bias_walk) << format;
}

TEST_F(Interoperability, RigsComeBackToTheLastDigit) {
  const std::vector<RoundTrip> formats = {{"kalibr", "x/camchain-imucam.yaml x/imu.yaml"},
                                          {"tum", "x/camchain-imucam.yaml x/imu.yaml"},
                                          {"csv", "x/camchain-imucam.yaml x/imu.yaml"},
                                          {"openvins", "x/estimator_config.yaml"},
                                          {"vins", "x/vins_config.yaml"},
                                          {"euroc", "x"}};
  for (const std::string lens :
       {"distortion: none",
        "distortion: radtan, distortion_coefficients: [-0.283, 0.074, "
        "1.9e-4, 1.8e-05]",
        "distortion: equidistant, distortion_coefficients: [0.0035, 7.1e-4, -0.002, 2.0e-4]"}) {
    simulate(lens);
    for (const auto& [format, files] : formats) {
      fs::remove_all(folder_ / "x");
      fs::remove(folder_ / "back.yaml");
      ASSERT_EQ(plumbline("export data --format " + format + " --out x").code, 0) << format;
      const ProgramResult result = plumbline("import " + files + " --out back.yaml");
      ASSERT_EQ(result.code, 0) << result.err;
      const sim::ScenarioConfig back = scenario("back.yaml");
      expect_same_rig(scenario("scenario.yaml"), back, format);
      if (format == "openvins" || format == "vins") {
        EXPECT_EQ(back.gravity_m_s2, 9.80665);
      }
      if (format == "openvins") {
        EXPECT_EQ(back.camera.pixel_sigma_px, 0.7);
      }
      if (format == "euroc") {
        EXPECT_EQ(back.camera.rate_hz, 20.0);
      }
    }
  }
}

// By hand: half the readout is 0.01355 s, a row of 478 takes 0.0271 / 478 s, and the root of 250 Hz is 15.8113883.
TEST_F(Interoperability, ExportsHaveTheirProgramsConventions) {
  simulate("distortion: none");
  for (const char* format : {"kalibr", "openvins", "vins", "euroc"}) {
    ASSERT_EQ(plumbline(std::string("export data --format ") + format + " --out " + format).code, 0);
  }
  EXPECT_NEAR(number_in("kalibr/camchain-imucam.yaml", "  timeshift_cam_imu"), 0.0123 - 0.01355, 1e-17);
  EXPECT_NEAR(number_in("kalibr/camchain-imucam.yaml", "  line_delay"), 5.669456066945607e-5, 1e-19);
  EXPECT_EQ(number_in("openvins/kalibr_imucam_chain.yaml", "  timeshift_cam_imu"), 0.0123);
  EXPECT_NEAR(number_in("euroc/mav0/cam0/sensor.yaml", "timeshift_cam_imu"), 0.0123 - 0.01355, 1e-17);
  EXPECT_EQ(number_in("vins/vins_config.yaml", "td"), 0.0123);
  EXPECT_EQ(number_in("vins/vins_config.yaml", "rolling_shutter_tr"), 0.0271);
  EXPECT_EQ(number_in("vins/vins_config.yaml", "rolling_shutter"), 1.0);
  EXPECT_NEAR(number_in("vins/vins_config.yaml", "acc_n"), 2.1e-3 * 15.811388300841896, 1e-12);
  EXPECT_NEAR(number_in("vins/vins_config.yaml", "gyr_w"), 2.3e-5 * 15.811388300841896, 1e-12);
  EXPECT_EQ(number_in("kalibr/imu.yaml", "accelerometer_noise_density"), 2.1e-3);
  // The camera in the body is the last column of T_imu_cam and T_BS.
  EXPECT_THAT(read(folder_ / "openvins/kalibr_imucam_chain.yaml"), HasSubstr(", 0.0613]\n"));
  EXPECT_THAT(read(folder_ / "euroc/mav0/cam0/sensor.yaml"), HasSubstr(", 0.0613, "));
  EXPECT_THAT(read(folder_ / "vins/vins_config.yaml"), HasSubstr("data: [0.0613, -0.0217, 0.0098]"));
}

// Kalibr's rotation takes the IMU's x axis to the optical axis; p_B_C = -R^T (0.1, 0.2, 0.3) = (-0.3, 0.1, 0.2).
TEST_F(Interoperability, KalibrByHand) {
  write("chain.yaml", R"(cam0:
  T_cam_imu:
  - [0.0, -1.0, 0.0, 0.1]
  - [0.0, 0.0, -1.0, 0.2]
  - [1.0, 0.0, 0.0, 0.3]
  - [0.0, 0.0, 0.0, 1.0]
  camera_model: pinhole
  distortion_coeffs: [-0.27695497, 0.06712482, 0.00087538, 0.00011556]
  distortion_model: radtan
  intrinsics: [461.629, 460.152, 362.680, 246.049]
  line_delay: 3.0e-05
  resolution: [752, 480]
  rostopic: /cam0/image_raw
  timeshift_cam_imu: -8.121e-05
cam1: {T_cn_cnm1: not read}
)");
  ASSERT_EQ(plumbline("import chain.yaml --out rig.yaml").code, 0);
  const sim::ScenarioConfig c = scenario("rig.yaml");
  EXPECT_EQ(c.camera.extrinsic_position_m, Eigen::Vector3d(-0.3, 0.1, 0.2));
  EXPECT_EQ(c.camera.extrinsic_rotation_xyzw, Eigen::Vector4d(-0.5, 0.5, -0.5, 0.5));
  EXPECT_EQ(c.camera.readout_s, 0.0144);
  EXPECT_EQ(c.camera.td_s, 0.00711879);  // of the middle row: 7.2 ms later
  EXPECT_EQ(c.camera.model.distortion.model(), core::DistortionModel::kRadtan);
  EXPECT_EQ(c.camera.model.cy_px, 246.049);
  EXPECT_THAT(read(folder_ / "rig.yaml"),
              HasSubstr("Not stated there, hence defaults: the camera's rate, the IMU's noise, "
                        "trajectory."));
}

constexpr const char* kOpenvinsChain = R"(%YAML:1.0

cam0:
  T_imu_cam: #rotation from camera to IMU R_CtoI, position of camera in IMU p_CinI
    - [0.0148655429818, -0.999880929698, 0.00414029679422, -0.0216401454975]
    - [0.999557249008, 0.0149672133247, 0.025715529948, -0.064676986768]
    - [-0.0257744366974, 0.00375618835797, 0.999660727178, 0.00981073058949]
    - [0.0, 0.0, 0.0, 1.0]
  cam_overlaps: [1]
  camera_model: pinhole
  distortion_coeffs: [-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05]
  distortion_model: radtan
  intrinsics: [458.654, 457.296, 367.215, 248.375] #fu, fv, cu, cv
  resolution: [752, 480]
  rostopic: /cam0/image_raw
  timeshift_cam_imu: 0.0052
)";
constexpr const char* kOpenvinsImu = R"(%YAML:1.0

imu0:
  T_i_b:
    - [1.0, 0.0, 0.0, 0.0]
    - [0.0, 1.0, 0.0, 0.0]
    - [0.0, 0.0, 1.0, 0.0]
    - [0.0, 0.0, 0.0, 1.0]
  accelerometer_noise_density: 2.0000e-3  # [ m / s^2 / sqrt(Hz) ]   ( accel "white noise" )
  accelerometer_random_walk: 3.0000e-3    # [ m / s^3 / sqrt(Hz) ].  ( accel bias diffusion )
  gyroscope_noise_density: 1.6968e-04     # [ rad / s / sqrt(Hz) ]   ( gyro "white noise" )
  gyroscope_random_walk: 1.9393e-05       # [ rad / s^2 / sqrt(Hz) ] ( gyro bias diffusion )
  rostopic: /imu0
  time_offset: 0.0
  update_rate: 200.0
  model: "kalibr"
)";

// The rotation of EuRoC's left camera: w = sqrt(1 + trace) / 2, x = (R32 - R23) / 4w and so on.
const Eigen::Vector4d kEurocRotation(-0.00770718, 0.01049932, 0.70175280, 0.71230146);

TEST_F(Interoperability, OpenvinsByHand) {
  fs::create_directory(folder_ / "euroc_mav");
  write("euroc_mav/kalibr_imucam_chain.yaml", kOpenvinsChain);
  write("euroc_mav/kalibr_imu_chain.yaml", kOpenvinsImu);
  write("euroc_mav/estimator_config.yaml",
        "%YAML:1.0 # need to specify the file type at the top!\n\ngravity_mag: 9.81\nup_msckf_sigma_px: 1\n"
        "relative_config_imu: \"kalibr_imu_chain.yaml\"\nrelative_config_imucam: \"kalibr_imucam_chain.yaml\"\n");
  const ProgramResult result = plumbline("import euroc_mav/estimator_config.yaml --out rig.yaml");
  ASSERT_EQ(result.code, 0) << result.err;
  const sim::ScenarioConfig c = scenario("rig.yaml");
  EXPECT_LT((c.camera.extrinsic_rotation_xyzw - kEurocRotation).cwiseAbs().maxCoeff(), 1e-8);
  EXPECT_EQ(c.camera.extrinsic_position_m, Eigen::Vector3d(-0.0216401454975, -0.064676986768, 0.00981073058949));
  EXPECT_EQ(c.camera.td_s, 0.0052);
  EXPECT_EQ(c.camera.readout_s, 0.0);
  EXPECT_EQ(c.imu.rate_hz, 200.0);
  EXPECT_EQ(c.imu.noise.gyro_bias_walk, 1.9393e-05);
  EXPECT_EQ(c.imu.noise.accel_bias_walk, 3e-3);
  // The two files alone say the same but gravity and the pixels' noise.
  ASSERT_EQ(plumbline("import euroc_mav/kalibr_imucam_chain.yaml euroc_mav/kalibr_imu_chain.yaml --out two.yaml").code,
            0);
  expect_same_rig(c, scenario("two.yaml"), "two files");
}

constexpr const char* kVins = R"(%YAML:1.0

#common parameters
imu_topic: "/imu0"
output_path: "/home/user/output/"
model_type: PINHOLE
camera_name: camera
image_width: 752
image_height: 480
distortion_parameters:
   k1: -2.9839715720358556e-01
   k2: 9.2224519780237782e-02
   p1: -1.1990340691497372e-04
   p2: -7.4597868882045419e-05
projection_parameters:
   fx: 4.6894439430045497e+02
   fy: 4.6967991177317680e+02
   cx: 3.5308385782266549e+02
   cy: 2.2974410036895023e+02
estimate_extrinsic: 1   # 1  Have an initial guess about extrinsic parameters.
extrinsicRotation: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [0.0148655429818, -0.999880929698, 0.00414029679422,
           0.999557249008, 0.0149672133247, 0.025715529948, 
           -0.0257744366974, 0.00375618835797, 0.999660727178]
extrinsicTranslation: !!opencv-matrix
   rows: 3
   cols: 1
   dt: d
   data: [-0.0216401454975,-0.064676986768, 0.00981073058949]
acc_n: 0.1          # accelerometer measurement noise standard deviation. #0.2   0.04
gyr_n: 0.01         # gyroscope measurement noise standard deviation.     #0.05  0.004
acc_w: 0.001
gyr_w: 0.0001
g_norm: 9.8
estimate_td: 1
td: -0.01
rolling_shutter: 1
rolling_shutter_tr: 0.033
)";

// Densities are a sample's noise over the root of 200 Hz, 14.142135623731.
TEST_F(Interoperability, VinsByHand) {
  write("euroc_config.yaml", kVins);
  const ProgramResult rateless = plumbline("import euroc_config.yaml --out rig.yaml");
  EXPECT_EQ(rateless.code, 2);
  EXPECT_EQ(rateless.err,
            "plumbline: euroc_config.yaml:33: acc_n: is of a sample: give the IMU's rate (--imu-rate HZ)\n");
  ASSERT_EQ(plumbline("import euroc_config.yaml --imu-rate 200 --out rig.yaml").code, 0);
  const sim::ScenarioConfig c = scenario("rig.yaml");
  EXPECT_NEAR(c.imu.noise.accel_noise_density, 7.0710678118655e-3, 1e-16);
  EXPECT_NEAR(c.imu.noise.gyro_noise_density, 7.0710678118655e-4, 1e-17);
  EXPECT_NEAR(c.imu.noise.accel_bias_walk, 7.0710678118655e-5, 1e-18);
  EXPECT_NEAR(c.imu.noise.gyro_bias_walk, 7.0710678118655e-6, 1e-19);
  EXPECT_EQ(c.imu.rate_hz, 200.0);
  EXPECT_EQ(c.camera.td_s, -0.01);
  EXPECT_EQ(c.camera.td_reference_row, core::RowReference::kMiddle);
  EXPECT_EQ(c.camera.readout_s, 0.033);
  EXPECT_EQ(c.gravity_m_s2, 9.8);
  EXPECT_LT((c.camera.extrinsic_rotation_xyzw - kEurocRotation).cwiseAbs().maxCoeff(), 1e-8);
  EXPECT_EQ(c.camera.model.fx_px, 468.94439430045497);
  EXPECT_EQ(c.camera.model.distortion.coefficients()[2], -1.1990340691497372e-04);
  // VINS-Fusion keeps the camera in a file of its own and the extrinsics in one matrix.
  write("cam0.yaml",
        std::string("%YAML:1.0\n---\n") + std::string(kVins).substr(std::string(kVins).find("model_type"), 440));
  write("fusion.yaml", R"(%YAML:1.0
cam0_calib: "cam0.yaml"
body_T_cam0: !!opencv-matrix
   rows: 4
   cols: 4
   dt: d
   data: [0.0148655429818, -0.999880929698, 0.00414029679422, -0.0216401454975,
           0.999557249008, 0.0149672133247, 0.025715529948, -0.064676986768,
           -0.0257744366974, 0.00375618835797, 0.999660727178, 0.00981073058949,
           0, 0, 0, 1]
acc_n: 0.1
gyr_n: 0.01
acc_w: 0.001
gyr_w: 0.0001
td: -0.01
rolling_shutter: 1
rolling_shutter_tr: 0.033
)");
  const ProgramResult fusion = plumbline("import fusion.yaml --imu-rate 200 --out fusion_rig.yaml");
  ASSERT_EQ(fusion.code, 0) << fusion.err;
  expect_same_rig(c, scenario("fusion_rig.yaml"), "fusion");
}

TEST_F(Interoperability, TrajectoriesEvaluateTheSameInEveryFormat) {
  simulate("distortion: none");
  // Something to be compared with that is neither the truth nor rigidly moved.
  std::vector<core::StampedPose> bent;
  for (const auto& [t_ns, s] : sim::read_truth(folder_ / "data").states) {
    const double t = core::to_seconds(t_ns);
    bent.push_back({t_ns,
                    {s.T_W_B.q * core::exp_quaternion(Eigen::Vector3d(0.01 * t, 0, 0.02)),
                     s.T_W_B.p + Eigen::Vector3d(0.1 * t * t, 0, 0.05)}});
  }
  core::write_tum(folder_ / "bent.tum", bent);
  const std::map<std::string, std::string> files = {
      {"tum", "trajectory.tum"},    {"euroc", "mav0/state_groundtruth_estimate0/data.csv"},
      {"kalibr", "trajectory.tum"}, {"openvins", "groundtruth.txt"},
      {"vins", "groundtruth.csv"},  {"csv", "trajectory.csv"}};
  const json expected = json::parse(
      plumbline("evaluate data/truth/mav0/state_groundtruth_estimate0/data.csv --truth bent.tum --json").out);
  EXPECT_GT(expected["ate_position_m"]["rmse"], 0.01);
  for (const auto& [format, file] : files) {
    ASSERT_EQ(plumbline(fmt::format("export data --format {0} --out {0}", format)).code, 0);
    const ProgramResult result = plumbline(fmt::format("evaluate {}/{} --truth bent.tum --json", format, file));
    ASSERT_EQ(result.code, 0) << format << result.out << result.err;
    const json scored = json::parse(result.out);
    EXPECT_EQ(scored["matched"], expected["matched"]) << format;
    for (const char* metric : {"ate_position_m", "ate_rotation_deg"}) {
      EXPECT_NEAR(scored[metric]["rmse"].get<double>(), expected[metric]["rmse"].get<double>(), 1e-12) << format;
    }
  }
  EXPECT_THAT(read(folder_ / "vins/groundtruth.csv"), HasSubstr(",\n"));
}

TEST_F(Interoperability, TumFilesAreWhatEvoReads) {
  simulate("distortion: none");
  ASSERT_EQ(plumbline("export data --format tum --out tum").code, 0);
  std::ifstream file(folder_ / "tum/trajectory.tum");
  double before = -1.0;
  int poses = 0;
  for (std::string line; std::getline(file, line);) {
    if (line.starts_with('#')) continue;
    ++poses;
    std::istringstream stream(line);
    std::vector<double> v;
    for (std::string word; stream >> word;) {
      const std::size_t point = word.find('.');
      ASSERT_NE(point, std::string::npos) << line;
      EXPECT_GE(std::min(word.find('e'), word.size()) - point - 1, 9U) << line;
      v.push_back(std::stod(word));
    }
    ASSERT_EQ(v.size(), 8U);
    EXPECT_GT(v[0], before);
    before = v[0];
    EXPECT_NEAR(std::hypot(std::hypot(v[4], v[5]), std::hypot(v[6], v[7])), 1.0, 1e-15);
  }
  EXPECT_EQ(poses, 501);
}

// Export, import with the recorded path, simulate: one's own rig in two commands.
TEST_F(Interoperability, AnImportedRigIsSimulated) {
  simulate("distortion: none");
  ASSERT_EQ(plumbline("export data --format euroc --out x").code, 0);
  fs::create_directory(folder_ / "scenarios");
  const ProgramResult imported = plumbline("import x --out scenarios/own.yaml");
  ASSERT_EQ(imported.code, 0) << imported.err;
  EXPECT_THAT(read(folder_ / "scenarios/own.yaml"),
              HasSubstr("file: \"../x/mav0/state_groundtruth_estimate0/data.csv\""));
  const ProgramResult simulated = plumbline("simulate scenarios/own.yaml --out again");
  ASSERT_EQ(simulated.code, 0) << simulated.err;
  EXPECT_EQ(sim::read_truth(folder_ / "again").calibration.td_s, 0.0123);
  // KITTI's poses have no stamps.
  std::string kitti;
  for (int i = 0; i < 40; ++i) kitti += fmt::format("1 0 0 {} 0 1 0 0 0 0 1 {}\n", 0.1 * i, 0.01 * i * i);
  write("00.txt", kitti);
  EXPECT_EQ(plumbline("import 00.txt --out kitti.yaml").code, 2);
  ASSERT_EQ(plumbline("import 00.txt --pose-rate 10 --out kitti.yaml").code, 0);
  EXPECT_EQ(scenario("kitti.yaml").duration_s, 3.9);
}

TEST_F(Interoperability, OpenvinsStatesAreEvaluated) {
  simulate("distortion: none");
  // The truth, every state 0.1 m off along x; td 2 ms too large.
  std::ostringstream states;
  std::ostringstream deviations;
  states << "# timestamp(s) q p v bg ba cam_imu_dt num_cam cam0_k cam0_d cam0_rot cam0_trans .... etc\n";
  deviations << states.str();
  states.precision(9);
  states << std::fixed;
  int k = 0;
  for (const auto& [t_ns, s] : sim::read_truth(folder_ / "data").states) {
    if (++k % 10 != 0) continue;
    const auto& q = s.T_W_B.q;
    const auto& p = s.T_W_B.p;
    states << core::to_seconds(t_ns) << ' ' << q.x() << ' ' << q.y() << ' ' << q.z() << ' ' << q.w() << ' '
           << p.x() + 0.1 << ' ' << p.y() << ' ' << p.z()
           << " 0 0 0 0 0 0 0 0 0 0.0143000 1 458 457 367 248 0 0 0 0 0 0 0 1 0 0 0 \n";
    deviations << std::fixed << core::to_seconds(t_ns)
               << " 0.01 0.01 0.01 0.05 0.2 0.2 0 0 0 0 0 0 0 0 0 0.001 1 0 0 0 0 \n";
  }
  write("states.txt", states.str());
  write("std.txt", deviations.str());
  const ProgramResult result = plumbline("evaluate states.txt --std std.txt --truth data --align none --json");
  ASSERT_EQ(result.code, 0) << result.err << result.out;
  const json scored = json::parse(result.out);
  EXPECT_EQ(scored["stamp_clock"], "imu");
  EXPECT_NEAR(scored["ate_position_m"]["rmse"].get<double>(), 0.1, 1e-8);
  EXPECT_LT(scored["ate_rotation_deg"]["max"], 1e-5);  // nine decimals
  EXPECT_NEAR(scored["td"]["error_s"].get<double>(), 0.002, 1e-12);
  EXPECT_EQ(scored["td"]["sigma_s"], 0.001);
  EXPECT_TRUE(scored["td"]["convergence_s"].is_null());
  EXPECT_NEAR(scored["consistency"]["nees_position"].get<double>(), 4.0, 1e-6);  // (0.1 / 0.05)^2
  EXPECT_EQ(plumbline("evaluate states.txt --truth data --json").code, 0);
  EXPECT_THAT(plumbline("evaluate states.txt --truth data").out, HasSubstr("error 2.000000 ms, middle row"));

  write("short.txt", deviations.str().substr(0, deviations.str().size() / 2));
  EXPECT_EQ(plumbline("evaluate states.txt --std short.txt --truth data").code, 2);
  write("few.txt", "# timestamp(s) q p v bg ba cam_imu_dt num_cam\n1 0 0 0 1 0 0 0\n");
  EXPECT_EQ(plumbline("evaluate few.txt --truth data").err,
            "plumbline: few.txt:2: has 8 columns; td is in column 18\n");
}

// VINS stamps its results by the camera's clock.
TEST_F(Interoperability, VinsResultsAreMovedByTheirTd) {
  simulate("distortion: none");
  ASSERT_EQ(plumbline("export data --format vins --out x").code, 0);
  std::istringstream truth(read(folder_ / "x/groundtruth.csv"));
  std::string late;
  for (std::string line; std::getline(truth, line);) {
    if (line.starts_with('#')) continue;
    late += std::to_string(std::stoll(line) - 14'000'000) + line.substr(line.find(',')) + "\n";
  }
  write("vins.csv", late);
  const json moved = json::parse(plumbline("evaluate vins.csv --td 0.014 --truth data --align none --json").out);
  EXPECT_LT(moved["ate_position_m"]["rmse"], 1e-12);
  EXPECT_EQ(moved["stamp_clock"], "camera");
  EXPECT_NEAR(moved["td"]["error_s"].get<double>(), 0.014 - 0.0123, 1e-15);
  const json unmoved = json::parse(plumbline("evaluate vins.csv --truth data --align none --json").out);
  EXPECT_GT(unmoved["ate_position_m"]["rmse"], 1e-3);
}

// td of the first row, 13.55 ms below that of the middle one, in the camera's clock.
TEST_F(Interoperability, AHistoryOfTdTellsWhenItConverged) {
  simulate("distortion: none");
  ASSERT_EQ(plumbline("export data --format tum --out x").code, 0);
  fs::rename(folder_ / "x/trajectory.tum", folder_ / "x/estimate.tum");
  write("x/meta.yaml", "stamp_clock: imu\ntd_s: -0.001\ntd_reference_row: first\nreadout_s: 0.0271\n");
  write("x/td.csv", "#t_ns,td_s\n500000000,-0.001\n1000000000,0.001\n1500000000,-0.0021\n1900000000,-0.0003\n");
  const json scored = json::parse(plumbline("evaluate x --truth data --json").out);
  EXPECT_NEAR(scored["td"]["error_s"].get<double>(), 0.01255 - 0.0123, 1e-15);
  const double first_s = core::to_seconds(sim::read_truth(folder_ / "data").states.front().t_ns);
  EXPECT_NEAR(scored["td"]["convergence_s"].get<double>(), 1.5 - first_s, 1e-9);
  EXPECT_THAT(plumbline("evaluate x --truth data").out, HasSubstr("td within 1 ms for good: after 1.500 s"));
  write("x/td.csv", "#t_ns,td_s\n500000000,-0.001\n500000000,0.001\n");
  const ProgramResult twice = plumbline("evaluate x --truth data");
  EXPECT_EQ(twice.code, 2);
  EXPECT_EQ(twice.err, "plumbline: x/td.csv:3: stamps must increase\n");
}

TEST_F(Interoperability, BadFilesGiveOneClearLine) {
  const std::string chain = kOpenvinsChain;
  const std::string imu = kOpenvinsImu;
  const auto changed = [](std::string text, const std::string& from, const std::string& to) {
    return text.replace(text.find(from), from.size(), to);
  };
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"just: words\n",
       "x.yaml: neither cam0, imu0, update_rate (Kalibr), relative_config_imucam (OpenVINS), acc_n "
       "(VINS) nor sensor_type (EuRoC) is a key of it"},
      {"cam0: [\n", "x.yaml:"},
      {"", "x.yaml: cannot be read"},
      {changed(chain, "camera_model: pinhole", "camera_model: omni"), "x.yaml:10: camera_model: must be pinhole"},
      {changed(chain, "radtan", "fov"),
       "x.yaml:12: distortion_model: 'fov' is not known here; radtan, equidistant or none"},
      {changed(chain, "[752, 480]", "[752.5, 480]"), "x.yaml:14: resolution: must hold whole numbers of pixels"},
      {changed(chain, "458.654, ", ""), "x.yaml:13: intrinsics: must hold 4 numbers, not 3"},
      {changed(chain, "458.654", "f"), "x.yaml:13: intrinsics: must be a number"},
      {changed(chain, "0.999660727178", "0.5"), "x.yaml:5: T_imu_cam: is not a rotation: R R^T is off the identity by"},
      {changed(chain, "[0.0, 0.0, 0.0, 1.0]", "[0.0, 0.0, 0.0, 2.0]"),
       "x.yaml:5: T_imu_cam: must end with the row 0, 0, 0, 1"},
      {changed(chain, "  intrinsics", "  other"), "x.yaml:4: intrinsics: is missing"},
      {changed(chain, "0.0052", "20"), "out.yaml:"},
      {changed(imu, "time_offset: 0.0", "time_offset: 0.1"),
       "x.yaml:14: time_offset: must be 0: the IMU's clock is the one that td is of"},
      {changed(imu, "gyroscope_noise_density", "gyro"), "x.yaml:4: gyroscope_noise_density: is missing"},
      {changed(kVins, "PINHOLE", "MEI"), "x.yaml:6: model_type: 'MEI' is not known here; PINHOLE or KANNALA_BRANDT"},
      {"sensor_type: lidar\nT_BS: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]\n",
       "x.yaml:1: sensor_type: must be camera or imu"},
  };
  for (const auto& [text, message] : cases) {
    write("x.yaml", text);
    const ProgramResult result = plumbline("import x.yaml --imu-rate 200 --out out.yaml");
    EXPECT_EQ(result.code, 2) << text;
    EXPECT_THAT(result.err, ::testing::StartsWith("plumbline: " + message));
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    EXPECT_FALSE(fs::exists(folder_ / "out.yaml")) << text;
  }
  write("x.yaml", chain);
  EXPECT_THAT(plumbline("import x.yaml x.yaml --out out.yaml").err,
              HasSubstr("x.yaml:3: another file states the camera already"));
  EXPECT_EQ(plumbline("import none.yaml --out out.yaml").err, "plumbline: none.yaml: no such file or folder\n");
  write("out.yaml", "");
  EXPECT_EQ(plumbline("import x.yaml --out out.yaml").err, "plumbline: out.yaml: exists already\n");
  // No truth, no poses.
  simulate("distortion: none");
  fs::remove_all(folder_ / "data/truth");
  const ProgramResult blind = plumbline("export data --format tum --out x");
  EXPECT_EQ(blind.err, "plumbline: data: holds no truth, of which the poses are\n");
  EXPECT_FALSE(fs::exists(folder_ / "x"));
  EXPECT_EQ(plumbline("export data --format kalibr --out x").code, 0);
}

}  // namespace
}  // namespace plumbline
