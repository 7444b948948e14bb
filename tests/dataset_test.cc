#include "core/dataset.h"

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "sim/simulate.h"
#include "sim/truth_files.h"

namespace plumbline::sim {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

ScenarioConfig some_config() {
  ScenarioConfig config;
  config.duration_s = 2.0;
  config.imu.noise = {
      .gyro_noise_density = 1.7e-4, .gyro_bias_walk = 2e-5, .accel_noise_density = 2e-3, .accel_bias_walk = 3e-3};
  config.imu.gyro_bias_rad_s = {0.01, -0.02, 0.015};
  config.imu.accel_bias_m_s2 = {0.05, -0.08, 0.03};
  config.camera.td_s = 0.02;
  config.camera.readout_s = 0.03;
  config.camera.model.distortion = {core::DistortionModel::kRadtan, {-0.283, 0.074, 2e-4, 2e-5}};
  config.world.landmarks = 500;
  config.points.per_frame = 30;
  config.points.loss_probability = 0.05;
  config.prior.start = PriorStart::kDrawn;
  return config;
}

// Equality of every number, to the bit but for the sign of zero.
bool same(const core::Pose& a, const core::Pose& b) { return a.p == b.p && a.q.coeffs() == b.q.coeffs(); }

bool same(const core::State& a, const core::State& b) {
  return same(a.T_W_B, b.T_W_B) && a.v_W == b.v_W && a.bias.gyro_rad_s == b.bias.gyro_rad_s &&
         a.bias.accel_m_s2 == b.bias.accel_m_s2;
}

bool same(const core::RigCalibration& a, const core::RigCalibration& b) {
  return same(a.T_B_C, b.T_B_C) && a.td_s == b.td_s && a.readout_s == b.readout_s && a.intrinsics == b.intrinsics;
}

bool same(const std::vector<core::ImuSample>& a, const std::vector<core::ImuSample>& b) {
  return std::ranges::equal(a, b, [](const core::ImuSample& x, const core::ImuSample& y) {
    return x.t_ns == y.t_ns && x.gyro_rad_s == y.gyro_rad_s && x.accel_m_s2 == y.accel_m_s2;
  });
}

bool same(const std::vector<core::Frame>& a, const std::vector<core::Frame>& b) {
  const auto same_point = [](const core::PointObservation& x, const core::PointObservation& y) {
    return x.track_id == y.track_id && x.pixel == y.pixel && x.velocity == y.velocity;
  };
  const auto same_line = [](const core::LineObservation& x, const core::LineObservation& y) {
    return x.track_id == y.track_id && x.ends_px == y.ends_px && x.velocities == y.velocities;
  };
  return std::ranges::equal(a, b, [&](const core::Frame& x, const core::Frame& y) {
    return x.t_cam_ns == y.t_cam_ns && std::ranges::equal(x.points, y.points, same_point) &&
           std::ranges::equal(x.lines, y.lines, same_line);
  });
}

bool same(const core::InitialPrior& a, const core::InitialPrior& b) {
  const core::CalibrationSigmas& s = a.calibration_sigma;
  const core::CalibrationSigmas& t = b.calibration_sigma;
  return a.t_ns == b.t_ns && same(a.mean, b.mean) && a.sigma.per_axis() == b.sigma.per_axis() &&
         same(a.calibration, b.calibration) && s.td_s == t.td_s && s.readout_s == t.readout_s &&
         s.extrinsic_position_m == t.extrinsic_position_m && s.extrinsic_rotation_rad == t.extrinsic_rotation_rad &&
         s.focal_px == t.focal_px && s.principal_point_px == t.principal_point_px && same(a.start, b.start) &&
         same(a.start_calibration, b.start_calibration);
}

void expect_same(const core::MeasurementLog& a, const core::MeasurementLog& b) {
  EXPECT_TRUE(same(a.imu, b.imu));
  EXPECT_TRUE(same(a.frames, b.frames));
  EXPECT_TRUE(same(a.prior, b.prior));
  EXPECT_EQ(a.camera.width_px, b.camera.width_px);
  EXPECT_EQ(a.camera.height_px, b.camera.height_px);
  EXPECT_EQ(a.camera.fx_px, b.camera.fx_px);
  EXPECT_EQ(a.camera.fy_px, b.camera.fy_px);
  EXPECT_EQ(a.camera.cx_px, b.camera.cx_px);
  EXPECT_EQ(a.camera.cy_px, b.camera.cy_px);
  EXPECT_EQ(a.camera.distortion.model(), b.camera.distortion.model());
  EXPECT_EQ(a.camera.distortion.coefficients(), b.camera.distortion.coefficients());
  EXPECT_EQ(a.imu_noise.gyro_noise_density, b.imu_noise.gyro_noise_density);
  EXPECT_EQ(a.imu_noise.gyro_bias_walk, b.imu_noise.gyro_bias_walk);
  EXPECT_EQ(a.imu_noise.accel_noise_density, b.imu_noise.accel_noise_density);
  EXPECT_EQ(a.imu_noise.accel_bias_walk, b.imu_noise.accel_bias_walk);
  EXPECT_EQ(a.pixel_sigma_px, b.pixel_sigma_px);
  EXPECT_EQ(a.line_sigma_px, b.line_sigma_px);
  EXPECT_EQ(a.gravity_m_s2, b.gravity_m_s2);
}

void expect_same(const GroundTruth& a, const GroundTruth& b) {
  EXPECT_TRUE(same(a.calibration, b.calibration));
  EXPECT_TRUE(std::ranges::equal(a.states, b.states, [](const core::StampedState& x, const core::StampedState& y) {
    return x.t_ns == y.t_ns && same(x.state, y.state);
  }));
  EXPECT_EQ(a.landmarks_W, b.landmarks_W);
  EXPECT_EQ(a.track_landmark, b.track_landmark);
  EXPECT_TRUE(std::ranges::equal(a.segments_W, b.segments_W, {}, &Segment::ends_W, &Segment::ends_W));
  EXPECT_EQ(a.track_segment, b.track_segment);
  EXPECT_TRUE(std::ranges::equal(a.line_ends, b.line_ends, [](const LineEnds& x, const LineEnds& y) {
    return x.frame_ns == y.frame_ns && x.track_id == y.track_id && x.segment == y.segment && x.t_imu_s == y.t_imu_s &&
           x.ends_px == y.ends_px;
  }));
}

TEST(Simulate, SameTrialSameNumbers) {
  const Simulation a = simulate(some_config(), {.seed = 3, .trial = 4});
  const Simulation b = simulate(some_config(), {.seed = 3, .trial = 4});
  expect_same(a.measurements, b.measurements);
  expect_same(a.truth, b.truth);
}

TEST(Simulate, TrialsShareTheSceneButNotTheNoise) {
  const ScenarioConfig config = some_config();
  const Simulation a = simulate(config, {.seed = 3, .trial = 0});
  const Simulation b = simulate(config, {.seed = 3, .trial = 1});
  EXPECT_EQ(a.truth.landmarks_W, b.truth.landmarks_W);
  EXPECT_TRUE(same(a.truth.calibration, b.truth.calibration));
  ASSERT_EQ(a.truth.states.size(), b.truth.states.size());
  for (std::size_t i = 0; i < a.truth.states.size(); ++i) {
    const core::State& x = a.truth.states[i].state;
    const core::State& y = b.truth.states[i].state;
    EXPECT_TRUE(same(x.T_W_B, y.T_W_B) && x.v_W == y.v_W) << i;
    EXPECT_EQ(x.bias.gyro_rad_s == y.bias.gyro_rad_s, i == 0) << i;  // walks from a common start
    EXPECT_EQ(x.bias.accel_m_s2 == y.bias.accel_m_s2, i == 0) << i;
    EXPECT_NE(a.measurements.imu[i].gyro_rad_s, b.measurements.imu[i].gyro_rad_s) << i;
    EXPECT_NE(a.measurements.imu[i].accel_m_s2, b.measurements.imu[i].accel_m_s2) << i;
  }
  EXPECT_EQ(a.truth.states.front().state.bias.gyro_rad_s, config.imu.gyro_bias_rad_s);
  EXPECT_EQ(a.truth.states.front().state.bias.accel_m_s2, config.imu.accel_bias_m_s2);
  EXPECT_NE(a.measurements.frames.front().points.front().pixel, b.measurements.frames.front().points.front().pixel);
  EXPECT_NE(a.truth.track_landmark, b.truth.track_landmark);  // other losses
  EXPECT_NE(a.measurements.prior.calibration.td_s, b.measurements.prior.calibration.td_s);
  EXPECT_FALSE(same(a.measurements.prior.mean, b.measurements.prior.mean));
}

TEST(Simulate, SeedsDifferInTheScene) {
  const Simulation a = simulate(some_config(), {.seed = 3, .trial = 0});
  const Simulation b = simulate(some_config(), {.seed = 4, .trial = 0});
  EXPECT_NE(a.truth.landmarks_W, b.truth.landmarks_W);
  EXPECT_FALSE(same(a.truth.states.front().state.T_W_B, b.truth.states.front().state.T_W_B));
}

// What one sensor suffers leaves the draws of the others alone.
TEST(Simulate, CameraSettingsLeaveTheImuAlone) {
  const Simulation reference = simulate(some_config(), {.seed = 3, .trial = 0});
  ScenarioConfig config = some_config();
  config.camera.pixel_sigma_px = 3.0;
  config.points.loss_probability = 0.3;
  config.points.per_frame = 10;
  const Simulation changed = simulate(config, {.seed = 3, .trial = 0});
  EXPECT_TRUE(same(changed.measurements.imu, reference.measurements.imu));
  EXPECT_TRUE(same(changed.measurements.prior, reference.measurements.prior));
  EXPECT_FALSE(same(changed.measurements.frames, reference.measurements.frames));
}

// Rows 0 to height of each frame within [lead, duration - lead], and no frame more would fit.
TEST(Simulate, FramesLieWithinTheRecording) {
  for (const double td_s : {-0.2, 0.0, 0.02, 0.6}) {
    for (const double readout_s : {0.0, 0.03}) {
      ScenarioConfig config = some_config();
      config.camera.td_s = td_s;
      config.camera.readout_s = readout_s;
      const std::vector<core::Frame> frames = simulate(config, {.seed = 3, .trial = 0}).measurements.frames;
      ASSERT_FALSE(frames.empty());
      const double first_s = core::to_seconds(frames.front().t_cam_ns) + td_s - 0.5 * readout_s;
      const double last_s = core::to_seconds(frames.back().t_cam_ns) + td_s + 0.5 * readout_s;
      constexpr double kNanosecond = 1e-9;  // of rounded stamps
      const double interval_s = 1.0 / config.camera.rate_hz;
      EXPECT_GE(first_s, kCameraLeadS - kNanosecond);
      EXPECT_LT(first_s - interval_s, kCameraLeadS + kNanosecond);
      EXPECT_LE(last_s, config.duration_s - kCameraLeadS + kNanosecond);
      EXPECT_GT(last_s + interval_s, config.duration_s - kCameraLeadS - kNanosecond);
      for (std::size_t i = 1; i < frames.size(); ++i) {
        EXPECT_EQ(frames[i].t_cam_ns - frames[i - 1].t_cam_ns, 50'000'000);
      }
    }
  }
}

TEST(Simulate, TruthAtAnInstant) {
  const GroundTruth truth = simulate(some_config(), {.seed = 3, .trial = 0}).truth;
  for (const std::size_t i : {std::size_t{0}, std::size_t{7}, truth.states.size() - 1}) {
    EXPECT_TRUE(same(state_at(truth, truth.states[i].t_ns), truth.states[i].state)) << i;
  }
  const core::State a = truth.states[7].state;
  const core::State b = truth.states[8].state;
  const core::State between = state_at(truth, truth.states[7].t_ns + 1'250'000);  // a quarter of 5 ms
  EXPECT_LT((core::minus(between, a) - 0.25 * core::minus(b, a)).norm(), 1e-14);
  EXPECT_THROW(state_at(truth, -1), core::DataError);
  EXPECT_THROW(state_at(truth, truth.states.back().t_ns + 1), core::DataError);
  EXPECT_THROW(state_at({}, 0), core::DataError);
}

class Dataset : public testing::Test {
 protected:
  explicit Dataset(const ScenarioConfig& config = some_config())
      : simulation_(simulate(config, {.seed = 3, .trial = 0})) {
    fs::remove_all(folder_);
    core::write_dataset(folder_, simulation_.measurements, {.config_hash = "0123456789abcdef", .seed = 3, .trial = 0});
    write_truth(folder_, simulation_.truth);
  }
  void TearDown() override { fs::remove_all(folder_); }

  std::string text(const fs::path& file) const {
    std::ifstream in(folder_ / file, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }

  void rewrite(const fs::path& file, const std::string& text) const {
    std::ofstream(folder_ / file, std::ios::binary) << text;
  }

  std::string refusal() const {
    try {
      core::read_dataset(folder_);
    } catch (const core::InputError& error) {
      return error.what();
    }
    return "accepted";
  }

  // What is said about the file with one of its lines replaced (from 1; the first is a comment).
  std::string refusal_of(const fs::path& file, int line, const std::string& replacement) const {
    const std::string original = text(file);
    std::size_t begin = 0;
    for (int i = 1; i < line; ++i) begin = original.find('\n', begin) + 1;
    std::string changed = original;
    changed.replace(begin, original.find('\n', begin) - begin, replacement);
    rewrite(file, changed);
    std::string said = refusal();
    rewrite(file, original);
    return said;
  }

  const fs::path folder_ =
      fs::path(testing::TempDir()) /
      (std::string("plumbline_dataset_") + testing::UnitTest::GetInstance()->current_test_info()->name());
  const Simulation simulation_;
};

constexpr const char* kImu = "mav0/imu0/data.csv";
constexpr const char* kFrames = "mav0/cam0/data.csv";
constexpr const char* kPoints = "mav0/cam0/points.csv";

TEST_F(Dataset, ReadsBackToTheBit) {
  expect_same(core::read_dataset(folder_), simulation_.measurements);
  expect_same(read_truth(folder_), simulation_.truth);
}

TEST_F(Dataset, IsReadableWithoutTheTruth) {
  fs::remove_all(folder_ / "truth");
  expect_same(core::read_dataset(folder_), simulation_.measurements);
  EXPECT_THROW(read_truth(folder_), core::InputError);
}

TEST_F(Dataset, HoldsNoTruthOutsideItsFolder) {
  std::vector<std::string> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder_)) {
    if (entry.is_regular_file()) files.push_back(fs::relative(entry.path(), folder_).generic_string());
  }
  EXPECT_THAT(files, testing::UnorderedElementsAre(
                         "meta.yaml", "prior.yaml", "mav0/imu0/data.csv", "mav0/imu0/sensor.yaml", "mav0/cam0/data.csv",
                         "mav0/cam0/points.csv", "mav0/cam0/sensor.yaml", "truth/landmarks.csv", "truth/tracks.csv",
                         "truth/calibration.yaml", "truth/mav0/state_groundtruth_estimate0/data.csv"));
}

TEST_F(Dataset, IsNeverWrittenOver) {
  const std::string before = text(kImu);
  core::MeasurementLog other = simulation_.measurements;
  other.imu.clear();
  EXPECT_THROW(core::write_dataset(folder_, other, {}), core::DataError);
  EXPECT_EQ(text(kImu), before);

  EXPECT_THROW(core::write_dataset(folder_ / kImu, other, {}), core::DataError);  // a file
  const fs::path empty = folder_ / "empty";
  fs::create_directory(empty);
  core::write_dataset(empty, simulation_.measurements, {});
  expect_same(core::read_dataset(empty), simulation_.measurements);
}

TEST_F(Dataset, RefusesFilesThatWereCutShort) {
  for (const char* file : {"prior.yaml", "meta.yaml", "mav0/imu0/sensor.yaml", "mav0/cam0/sensor.yaml"}) {
    const std::string original = text(file);
    rewrite(file, original.substr(0, original.rfind('\n', original.size() - 2) + 1));  // without its last line
    EXPECT_THAT(refusal(), testing::AllOf(HasSubstr(file), HasSubstr("is missing"))) << file;
    rewrite(file, original);
  }
}

TEST_F(Dataset, AcceptsCarriageReturns) {
  for (const char* file : {kImu, kFrames, kPoints}) {
    std::string crlf;
    for (const char c : text(file)) {
      if (c == '\n') crlf += '\r';
      crlf += c;
    }
    rewrite(file, crlf);
  }
  expect_same(core::read_dataset(folder_), simulation_.measurements);
}

TEST_F(Dataset, NamesTheLineOfABrokenRow) {
  EXPECT_THAT(refusal_of(kImu, 3, "5000000,0.1,0.2"), HasSubstr("mav0/imu0/data.csv:3: "));
  EXPECT_THAT(refusal_of(kImu, 3, "5000000,0,0,0,0,0,0,0"), HasSubstr("mav0/imu0/data.csv:3: "));
  EXPECT_THAT(refusal_of(kImu, 3, "5000000,nan,0,0,0,0,9.81"), HasSubstr("mav0/imu0/data.csv:3: "));
  EXPECT_THAT(refusal_of(kImu, 3, "5000000,inf,0,0,0,0,9.81"), HasSubstr("mav0/imu0/data.csv:3: "));
  EXPECT_THAT(refusal_of(kImu, 3, "5000000,,0,0,0,0,9.81"), HasSubstr("mav0/imu0/data.csv:3: "));
  EXPECT_THAT(refusal_of(kImu, 3, "5000000,1e,0,0,0,0,9.81"), HasSubstr("mav0/imu0/data.csv:3: "));
  EXPECT_THAT(refusal_of(kImu, 3, "0.005,0,0,0,0,0,9.81"), HasSubstr("mav0/imu0/data.csv:3: "));
  EXPECT_THAT(refusal_of(kFrames, 4, "now"), HasSubstr("mav0/cam0/data.csv:4: "));
  const std::string frame = std::to_string(simulation_.measurements.frames.front().t_cam_ns);
  EXPECT_THAT(refusal_of(kPoints, 5, frame + ",3,nan,1"), HasSubstr("mav0/cam0/points.csv:5: "));
  EXPECT_THAT(refusal_of(kPoints, 5, frame + ",3,1"), HasSubstr("mav0/cam0/points.csv:5: "));
  EXPECT_THAT(refusal_of(kPoints, 5, frame + ",0.5,1,1"), HasSubstr("mav0/cam0/points.csv:5: "));
  EXPECT_EQ(refusal(), "accepted");
}

TEST_F(Dataset, VelocitiesMayBeAbsentButNotHalf) {
  const std::string frame = std::to_string(simulation_.measurements.frames.front().t_cam_ns);
  EXPECT_EQ(refusal_of(kPoints, 5, frame + ",3,1,1"), "accepted");
  EXPECT_EQ(refusal_of(kPoints, 5, frame + ",3,1,1,,"), "accepted");
  EXPECT_EQ(refusal_of(kPoints, 5, frame + ",3,1,1,0.5,-0.5"), "accepted");
  for (const char* row : {",3,1,1,0.5,", ",3,1,1,,0.5", ",3,1,1,0.5", ",3,1,1,0.5,nan"}) {
    EXPECT_THAT(refusal_of(kPoints, 5, frame + row), HasSubstr("mav0/cam0/points.csv:5: ")) << row;
  }
}

TEST_F(Dataset, RefusesStampsOutOfOrder) {
  EXPECT_THAT(refusal_of(kImu, 4, "5000000,0,0,0,0,0,9.81"), HasSubstr("mav0/imu0/data.csv:4: "));  // twice
  EXPECT_THAT(refusal_of(kImu, 4, "4000000,0,0,0,0,0,9.81"), HasSubstr("mav0/imu0/data.csv:4: "));
  const core::TimeNs first = simulation_.measurements.frames.front().t_cam_ns;
  EXPECT_THAT(refusal_of(kFrames, 3, std::to_string(first)), HasSubstr("mav0/cam0/data.csv:3: "));
  EXPECT_THAT(refusal_of(kFrames, 3, std::to_string(first - 1)), HasSubstr("mav0/cam0/data.csv:3: "));
}

TEST_F(Dataset, RefusesPointsOfUnknownFrames) {
  const std::vector<core::Frame>& frames = simulation_.measurements.frames;
  EXPECT_THAT(refusal_of(kPoints, 2, "17,0,1,1"), HasSubstr("mav0/cam0/points.csv:2: frame 17 "));
  const std::string late = std::to_string(frames.back().t_cam_ns + 1);
  const int last = 1 + static_cast<int>(simulation_.measurements.frames.size());  // some line
  EXPECT_THAT(refusal_of(kPoints, last, late + ",0,1,1"), HasSubstr("frame " + late));
  // Known, but the points of later frames come first.
  EXPECT_THAT(refusal_of(kPoints, 2, std::to_string(frames[1].t_cam_ns) + ",0,1,1"),
              HasSubstr("mav0/cam0/points.csv:3: "));
}

TEST_F(Dataset, RefusesWhatItCannotInterpret) {
  for (const char* file : {kImu, kFrames, kPoints, "prior.yaml", "meta.yaml", "mav0/cam0/sensor.yaml"}) {
    const std::string original = text(file);
    fs::remove(folder_ / file);
    EXPECT_THAT(refusal(), HasSubstr(fs::path(file).filename().string())) << file;
    rewrite(file, original);
  }
  EXPECT_THAT(refusal_of("meta.yaml", 1, "schema: \"plumbline-dataset/2\""), HasSubstr("plumbline-dataset/2"));
  EXPECT_THAT(refusal_of("meta.yaml", 1, "scheme: 1"), HasSubstr("meta.yaml:1: "));
}

TEST_F(Dataset, RefusesBrokenTruth) {
  const std::string states = "truth/mav0/state_groundtruth_estimate0/data.csv";
  const std::string original = text(states);
  const std::size_t second = original.find('\n') + 1;
  rewrite(states, original + original.substr(second, original.find('\n', second) + 1 - second));
  EXPECT_THROW(read_truth(folder_), core::DataError);
  rewrite(states, original.substr(0, second + 40) + "\n");
  EXPECT_THROW(read_truth(folder_), core::DataError);
}

ScenarioConfig config_with_lines() {
  ScenarioConfig config = some_config();
  config.world.lines.random = 400;
  config.lines = {.per_frame = 10, .sigma_px = 0.7, .slide_sigma_px = 2.0, .fragment_probability = 0.02};
  return config;
}

class UnsureCameraDataset : public Dataset {
 protected:
  UnsureCameraDataset()
      : Dataset([] {
          ScenarioConfig config = some_config();
          config.prior.focal_sigma_px = 4.0;
          config.prior.principal_point_sigma_px = 3.0;
          return config;
        }()) {}
};

TEST_F(UnsureCameraDataset, ReadsBackToTheBit) {
  const core::MeasurementLog& log = simulation_.measurements;
  EXPECT_EQ(log.camera.intrinsics(), *log.prior.calibration.intrinsics);
  EXPECT_NE(log.camera.intrinsics(), *simulation_.truth.calibration.intrinsics);
  expect_same(core::read_dataset(folder_), log);
  expect_same(read_truth(folder_), simulation_.truth);
}

TEST_F(UnsureCameraDataset, TellsTheTruthInTheTruthOnly) {
  fs::remove_all(folder_ / "truth");
  for (const auto& entry : fs::recursive_directory_iterator(folder_)) {
    if (entry.path().extension() != ".yaml") continue;
    EXPECT_THAT(text(entry.path()), testing::Not(HasSubstr("460.0"))) << entry.path();
  }
}

TEST_F(UnsureCameraDataset, RefusesAPriorThatIsNotOfItsCamera) {
  std::string prior = text("prior.yaml");
  const std::string with = prior;
  const auto replace_line = [&](const std::string& key, const std::string& line) {
    prior = with;
    const std::size_t at = prior.find(key);
    ASSERT_NE(at, std::string::npos);
    prior.replace(at, prior.find('\n', at) - at, line);
    rewrite("prior.yaml", prior);
  };
  replace_line("intrinsics_px", "intrinsics_px: [460, 460, 320, 240]");
  EXPECT_THAT(refusal(), HasSubstr("calibration.intrinsics_px: must be those of mav0/cam0/sensor.yaml"));
  replace_line("focal_px: ", "");
  EXPECT_THAT(refusal(), HasSubstr("calibration_sigma.focal_px"));
}

class LineDataset : public Dataset {
 protected:
  LineDataset() : Dataset(config_with_lines()) {}

  const std::string frame_ = std::to_string(simulation_.measurements.frames.front().t_cam_ns);
};

constexpr const char* kLines = "mav0/cam0/lines.csv";

TEST_F(LineDataset, ReadsBackToTheBit) {
  std::size_t lines = 0;
  std::size_t with_velocities = 0;
  for (const core::Frame& frame : simulation_.measurements.frames) {
    lines += frame.lines.size();
    for (const auto& line : frame.lines) with_velocities += line.velocities ? 1 : 0;
  }
  ASSERT_GT(lines, 100U);
  ASSERT_GT(with_velocities, 50U);
  ASSERT_LT(with_velocities, lines);  // of both kinds
  expect_same(core::read_dataset(folder_), simulation_.measurements);
  expect_same(read_truth(folder_), simulation_.truth);
}

TEST_F(LineDataset, IsReadableWithoutLines) {
  fs::remove(folder_ / kLines);
  EXPECT_THAT(refusal(), HasSubstr("lines.csv: cannot be read"));  // the sensor speaks of lines
  std::string sensor = text("mav0/cam0/sensor.yaml");
  const std::size_t key = sensor.find("line_sigma_px");
  ASSERT_NE(key, std::string::npos);
  rewrite("mav0/cam0/sensor.yaml", sensor.erase(key, sensor.find('\n', key) + 1 - key));
  core::MeasurementLog without = simulation_.measurements;
  without.line_sigma_px = 0.0;
  for (core::Frame& frame : without.frames) frame.lines.clear();
  expect_same(core::read_dataset(folder_), without);
}

TEST_F(LineDataset, RefusesLinesWithoutTheirNoise) {
  std::string sensor = text("mav0/cam0/sensor.yaml");
  const std::size_t key = sensor.find("line_sigma_px");
  rewrite("mav0/cam0/sensor.yaml", sensor.erase(key, sensor.find('\n', key) + 1 - key));
  EXPECT_THAT(refusal(), testing::AllOf(HasSubstr("sensor.yaml"), HasSubstr("line_sigma_px"), HasSubstr("is missing")));
}

TEST_F(LineDataset, HoldsTheRowsTimesInTheTruthOnly) {
  EXPECT_EQ(text(kLines).find("t_imu"), std::string::npos);
  for (const char* file : {"truth/segments.csv", "truth/line_tracks.csv", "truth/line_ends.csv"}) {
    EXPECT_TRUE(fs::exists(folder_ / file)) << file;
  }
  fs::remove_all(folder_ / "truth");
  expect_same(core::read_dataset(folder_), simulation_.measurements);
}

TEST_F(LineDataset, NamesTheLineOfABrokenRow) {
  const auto says = [&](const std::string& row) { return refusal_of(kLines, 2, frame_ + row); };
  EXPECT_EQ(says(",900,1,2,3,4"), "accepted");
  EXPECT_EQ(says(",900,1,2,3,4,,,,"), "accepted");
  EXPECT_EQ(says(",900,1,2,3,4,0.1,0.2,0.3,0.4"), "accepted");
  for (const char* row : {",900,1,2,3", ",900,1,2,3,nan", ",900,1,2,3,4,0.1,0.2", ",900,1,2,3,4,0.1,,,",
                          ",900,1,2,3,4,,,,0.4", ",900,1,2,3,4,,0.2,,", ",0.5,1,2,3,4", ",900,1,2,3,4,1,2,3,inf"}) {
    EXPECT_THAT(says(row), HasSubstr("mav0/cam0/lines.csv:2: ")) << row;
  }
  EXPECT_THAT(refusal_of(kLines, 2, "17,900,1,2,3,4"), HasSubstr("lines.csv:2: frame 17 "));
  const std::string second = std::to_string(simulation_.measurements.frames.front().lines.at(1).track_id);
  EXPECT_THAT(says("," + second + ",1,2,3,4"), HasSubstr("lines.csv:3: track " + second));
}

TEST_F(LineDataset, RefusesTruthOfUnknownSegments) {
  const std::string original = text("truth/line_tracks.csv");
  for (const char* row : {"0,400\n", "0,-1\n"}) {
    rewrite("truth/line_tracks.csv", row);
    EXPECT_THROW(read_truth(folder_), core::DataError) << row;
  }
  rewrite("truth/line_tracks.csv", original);
  rewrite("truth/line_ends.csv", "0,0,400,0,0,1,1,1,1\n");
  EXPECT_THROW(read_truth(folder_), core::DataError);
}

}  // namespace
}  // namespace plumbline::sim
