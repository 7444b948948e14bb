// Rigs to and from the files of Kalibr, OpenVINS, VINS and EuRoC.
#include "interoperability.h"

#include <array>
#include <cmath>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>

#include "sim/truth_files.h"

namespace plumbline {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

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
