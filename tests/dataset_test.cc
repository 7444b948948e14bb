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
#include "same_recording.h"
#include "sim/simulate.h"
#include "sim/truth_files.h"

namespace plumbline::sim {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

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
