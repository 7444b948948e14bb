// Input that breaks a rule: exit code 2, one line on stderr that names file, line and key, and nothing written.
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "program_test.h"

namespace plumbline {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

std::string repeat(const std::string& text, int times) {
  std::string result;
  for (int i = 0; i < times; ++i) result += text;
  return result;
}

// Every file below the folder with its size.
std::vector<std::string> sizes(const fs::path& folder) {
  std::vector<std::string> names;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    names.push_back(entry.path().generic_string() +
                    (entry.is_regular_file() ? std::string(":") + std::to_string(entry.file_size()) : "/"));
  }
  std::sort(names.begin(), names.end());
  return names;
}

struct Case {
  std::string name;
  std::string arguments;  // of the program, in the folder of the file
  fs::path file;          // that is written first, replacing a sound one
  std::string text;
  std::vector<std::string> says;  // parts of the message
  // What of a sound file `text` is written for; all of it where empty.
  std::string replaces = {};
};

void PrintTo(const Case& c, std::ostream* out) { *out << c.name; }

class Malformed : public ProgramTest, public ::testing::WithParamInterface<Case> {
 protected:
  // A sound dataset, estimate and pose file that the cases spoil.
  static void SetUpTestSuite() {
    sound_ = new fs::path(make_folder());
    save(*sound_ / "scenario.yaml",
         "duration_s: 1\nimu: {rate_hz: 50, gyro_noise_density_rad_s_sqrt_hz: 1e-3, gyro_bias_walk_rad_s2_sqrt_hz: "
         "1e-4, accel_noise_density_m_s2_sqrt_hz: 1e-2, accel_bias_walk_m_s3_sqrt_hz: 1e-3}\npoints: {per_frame: 5}\n"
         "world: {lines: {random: 300}}\nlines: {per_frame: 3}\n");
    std::string poses;
    for (int i = 0; i <= 100; ++i) {
      poses += std::to_string(0.05 * i) + " " + std::to_string(0.01 * i) + " 0 0 0 0 0 1\n";
    }
    save(*sound_ / "poses.tum", poses);
    save(*sound_ / "spline.yaml", "duration_s: 2\ntrajectory: {type: spline, file: poses.tum}\n");
    ASSERT_EQ(plumbline_in(*sound_, "simulate scenario.yaml --out data").code, 0);
  }
  static void TearDownTestSuite() {
    fs::remove_all(*sound_);
    delete sound_;
  }

  void SetUp() override {
    ProgramTest::SetUp();
    fs::copy(*sound_, folder_, fs::copy_options::recursive);
  }

  static fs::path* sound_;
};
fs::path* Malformed::sound_ = nullptr;

TEST_P(Malformed, OneLineCodeTwoNothingWritten) {
  const Case& c = GetParam();
  if (!c.replaces.empty()) {
    std::string text = read(folder_ / c.file);
    const std::size_t at = text.find(c.replaces);
    ASSERT_NE(at, std::string::npos) << c.replaces;
    write(c.file, text.replace(at, c.replaces.size(), c.text));
  } else if (!c.file.empty()) {
    write(c.file, c.text);
  }
  const std::vector<std::string> before = sizes(folder_);
  const ProgramResult result = plumbline(c.arguments);
  const std::string& message = result.err;
  EXPECT_EQ(result.code, 2) << message;
  EXPECT_EQ(std::count(message.begin(), message.end(), '\n'), 1) << message;
  EXPECT_LT(message.size(), 1000U);
  for (const std::string& part : c.says) EXPECT_THAT(message, HasSubstr(part));
  EXPECT_EQ(sizes(folder_), before);
}

// A scenario in x.yaml that is to be simulated.
Case scenario(std::string name, std::string text, std::vector<std::string> says) {
  says.insert(says.begin(), "x.yaml");
  return {std::move(name), "simulate x.yaml --out out", "x.yaml", std::move(text), std::move(says)};
}

// An experiment in x.yaml that is to be run.
Case experiment(std::string name, std::string text, std::vector<std::string> says) {
  says.insert(says.begin(), "x.yaml");
  return {std::move(name), "run x.yaml --out out", "x.yaml", std::move(text), std::move(says)};
}

Case command(std::string name, std::string arguments, std::vector<std::string> says) {
  return {std::move(name), std::move(arguments), "", "", std::move(says)};
}

Case poses(std::string name, std::string text, std::vector<std::string> says) {
  says.insert(says.begin(), "poses.tum");
  return {std::move(name), "simulate spline.yaml --out out", "poses.tum", std::move(text), std::move(says)};
}

// A dataset in which the first occurrence of `from` in one of its files becomes `to`.
Case edited(std::string name, const std::string& file, std::string from, std::string to,
            std::vector<std::string> says) {
  says.insert(says.begin(), file);
  return {.name = std::move(name),
          .arguments = "estimate data --out out",
          .file = fs::path("data") / file,
          .text = std::move(to),
          .says = std::move(says),
          .replaces = std::move(from)};
}

// A dataset of which one file is replaced.
Case dataset(std::string name, const std::string& file, std::string text, std::vector<std::string> says) {
  says.insert(says.begin(), file);
  return {std::move(name), "estimate data --out out", fs::path("data") / file, std::move(text), std::move(says)};
}

std::string pose_lines(const std::string& third) {
  return std::string("0 0 0 0 0 0 0 1\n0.05 0 0 0 0 0 0 1\n") + third + "\n0.15 0 0 0 0 0 0 1\n";
}

const std::string kImuHead = "#timestamp [ns],wx,wy,wz,ax,ay,az\n0,0,0,0,0,0,9.81\n20000000,0,0,0,0,0,9.81\n";

std::vector<Case> keys_and_values() {
  return {
      scenario("UnknownKey", "duraton_s: 3\n", {":1:", "duraton_s", "unknown key", "did you mean 'duration_s'"}),
      scenario("UnknownNestedKey", "camera:\n  td_s: 0.01\n  readout: 0.03\n", {":3:", "camera.readout", "readout_s"}),
      scenario("UnknownSection", "kamera: {td_s: 0}\n", {":1:", "kamera", "did you mean 'camera'"}),
      scenario("TextForNumber", "duration_s: long\n", {":1:", "duration_s", "number"}),
      scenario("ListForNumber", "\nduration_s: [3]\n", {":2:", "duration_s", "a list"}),
      scenario("MapForNumber", "duration_s: {a: 3}\n", {":1:", "duration_s", "a map"}),
      scenario("NumberForSection", "camera: 3\n", {":1:", "camera", "section"}),
      scenario("ListForSection", "camera: [1, 2]\n", {":1:", "camera"}),
      scenario("NothingForNumber", "duration_s:\n", {":1:", "duration_s", "nothing"}),
      scenario("Nan", "duration_s: .nan\n", {":1:", "duration_s"}),
      scenario("NanInWords", "duration_s: nan\n", {":1:", "duration_s", "finite"}),
      scenario("Infinite", "duration_s: .inf\n", {":1:", "duration_s"}),
      scenario("InfiniteInWords", "gravity_m_s2: inf\n", {":1:", "gravity_m_s2", "finite"}),
      scenario("Overflow", "gravity_m_s2: 1e999\n", {":1:", "gravity_m_s2"}),
      scenario("TooLarge", "camera: {td_s: 2}\n", {":1:", "camera.td_s", "[-1, 1]"}),
      scenario("TooSmall", "duration_s: 0\n", {":1:", "duration_s"}),
      scenario("Negative", "camera:\n  fx_px: -460\n", {":2:", "camera.fx_px", "[0.001, "}),
      scenario("ShortList", "imu: {gyro_bias_rad_s: [0, 0]}\n", {":1:", "imu.gyro_bias_rad_s", "3 numbers, got 2"}),
      scenario("LongList", "imu: {gyro_bias_rad_s: [0, 0, 0, 0]}\n", {":1:", "got 4"}),
      scenario("TextInList", "imu: {gyro_bias_rad_s: [0, x, 0]}\n", {":1:", "imu.gyro_bias_rad_s[1]"}),
      scenario("NumberForList", "imu: {gyro_bias_rad_s: 0}\n", {":1:", "list of 3 numbers"}),
      scenario("QuotedNumber", "duration_s: \"3\"\n", {":1:", "duration_s"}),
      scenario("Hexadecimal", "duration_s: 0x10\n", {":1:", "duration_s", "0x10"}),
      scenario("PlusSign", "duration_s: +3\n", {":1:", "duration_s"}),
      scenario("UnitInNumber", "duration_s: 3 s\n", {":1:", "duration_s", "3 s"}),
      scenario("DecimalComma", "duration_s: 3,5\n", {":1:", "duration_s", "3,5"}),
      scenario("FractionForInteger", "points: {per_frame: 2.5}\n", {":1:", "points.per_frame", "whole number"}),
      scenario("IntegerOverflow", "points: {per_frame: 99999999999}\n", {":1:", "points.per_frame"}),
      scenario("Choice", "trajectory: {type: handhold}\n", {":1:", "trajectory.type", "did you mean 'handheld'"}),
      scenario("ChoiceAsList", "trajectory: {type: [circle]}\n", {":1:", "trajectory.type"}),
      scenario("NotAUnitQuaternion", "camera:\n  extrinsic_rotation_xyzw: [0, 0, 0, 0.5]\n",
               {":2:", "camera.extrinsic_rotation_xyzw", "unit quaternion"}),
      scenario("FrequenciesReversed", "trajectory:\n  handheld: {lowest_frequency_hz: 2, highest_frequency_hz: 1}\n",
               {":2:", "trajectory.handheld.highest_frequency_hz"}),
      scenario("DistancesReversed", "world: {nearest_m: 5, farthest_m: 2}\n", {":1:", "world.farthest_m"}),
      scenario("LineDistancesReversed", "lines: {nearest_m: 5, farthest_m: 2}\n", {":1:", "lines.farthest_m"}),
      scenario("LineLengthsReversed", "world:\n  lines: {random_shortest_m: 5, random_longest_m: 2}\n",
               {":2:", "world.lines.random_longest_m"}),
      scenario("LinesInAWorldWithout", "lines: {per_frame: 20}\n", {":1:", "lines.per_frame", "world.lines"}),
      scenario("SplineWithoutFile", "trajectory: {type: spline}\n", {"trajectory.file"}),
      scenario("SplineFileMissing", "trajectory: {type: spline, file: nowhere.tum}\n",
               {":1:", "trajectory.file", "nowhere.tum"}),
      scenario("SplineFileIsAFolder", "trajectory: {type: spline, file: data}\n", {":1:", "trajectory.file", "data"}),
      scenario("LongKey", repeat("k", 100000) + ": 1\n", {":1:"}),
      scenario("LongValue", std::string("duration_s: ") + repeat("9", 100000) + "x\n", {":1:", "duration_s"}),
  };
}

// Values that are sound by their form, and would overflow or never end.
std::vector<Case> beyond_physics() {
  return {
      scenario("Gravity", "gravity_m_s2: 1e200\n", {":1:", "gravity_m_s2", "[0, 1000]"}),
      scenario("Rate", "trajectory: {handheld: {rate_rms_rad_s: 1e160}}\n", {":1:", "handheld.rate_rms_rad_s"}),
      scenario("OrientationSigma", "prior: {orientation_sigma_rad: 1e200}\n", {":1:", "prior.orientation_sigma_rad"}),
      scenario("TinySigma", "prior: {position_sigma_m: 1e-200}\n", {":1:", "prior.position_sigma_m", "1e-12"}),
      scenario("Margin", "world: {type: rooms, rooms: {margin_m: 1e4}}\n", {":1:", "rooms.longest_side_m", "larger"}),
      scenario("Clearance", "world: {type: rooms, walls: {clearance_m: 1e9}}\n", {":1:", "walls.clearance_m"}),
      scenario("Radius", "trajectory: {type: circle, loop: {radius_m: 1e300}}\n", {":1:", "loop.radius_m"}),
      scenario("TooManySegments", "world: {type: rooms, lines: {grid_spacing_m: 1e-9}}\nlines: {per_frame: 20}\n",
               {":1:", "scenario.world.lines", "fewer"}),
      scenario("TooFast", "trajectory: {type: circle, loop: {radius_m: 1e4, period_s: 0.01}}\n",
               {":1:", "scenario.trajectory", "slower"}),
      scenario("PathToNowhere",
               "duration_s: 3600\nimu: {rate_hz: 10}\nworld: {type: corridor}\n"
               "trajectory: {type: constant_acceleration, constant: {acceleration_m_s2: [1e4, 0, 0]}}\n",
               {":4:", "scenario.trajectory", "within"}),
      scenario("LensWithoutRays",
               "world: {type: frustum}\ncamera: {distortion: radtan, distortion_coefficients: [-1e6, 0, 0, 0]}\n",
               {":2:", "distortion_coefficients", "weaker"}),
      scenario("NoiseDensity", "imu: {gyro_noise_density_rad_s_sqrt_hz: 1e200}\n", {":1:", "gyro_noise_density"}),
      scenario("FocalLength", "camera: {fx_px: 1e-300}\n", {":1:", "camera.fx_px"}),
      {"TinyNoise",
       "run x.yaml --out out",
       "x.yaml",
       "scenario: scenario.yaml\nset: {scenario.imu.gyro_noise_density_rad_s_sqrt_hz: 1e-200}\n",
       {"x.yaml:", "estimator.imu.gyro_noise_density_rad_s_sqrt_hz", "1e-12"}},
      {"RunTooFast",
       "run x.yaml --out out",
       "x.yaml",
       "scenario: scenario.yaml\n"
       "set: {scenario.trajectory: {type: circle, loop: {radius_m: 1e4, period_s: 0.01}}}\n",
       {"x.yaml:2:", "scenario.trajectory", "slower"}},
  };
}

std::vector<Case> syntax() {
  return {
      scenario("EmptyFile", "", {}),
      scenario("OnlyAComment", "# nothing\n", {}),
      scenario("TopLevelList", "- 1\n- 2\n", {":1:"}),
      scenario("TopLevelScalar", "word\n", {":1:"}),
      scenario("RepeatedKey", "duration_s: 3\ngravity_m_s2: 9.81\nduration_s: 4\n", {":3:", "duration_s"}),
      scenario("Anchor", "duration_s: &a 3\n", {":1:", "anchor"}),
      scenario("Alias", "duration_s: *a\n", {":1:"}),
      scenario("Bomb", "a: &a [x, x]\nb: &b [*a, *a]\nc: &c [*b, *b]\nd: [*c, *c]\n", {":1:", "anchor"}),
      scenario("MergeKey", "<<: {duration_s: 3}\n", {":1:", "<<"}),
      scenario("Tag", "duration_s: !!float 3\n", {":1:", "tag"}),
      scenario("TwoDocuments", "duration_s: 3\n---\nduration_s: 4\n", {":2:", "second document"}),
      scenario("DeepBrackets", std::string("a: ") + repeat("[", 5000) + repeat("]", 5000) + "\n", {":1:"}),
      scenario("DeepUnclosedBrackets", std::string("a: ") + repeat("[", 200000) + "\n", {"x.yaml"}),
      scenario("DeepMaps", std::string() + repeat("{a: ", 3000) + "1" + repeat("}", 3000) + "\n", {":1:"}),
      scenario("DeepDashes", repeat("- ", 3000) + "1\n", {":1:"}),
      scenario("Binary", std::string("\x7f\x45\x4c\x46\x02\x01\x00\x01", 8), {":1:", "0x02"}),
      scenario("Nul", std::string("duration_s: 3\0\n", 15), {":1:", "0x00"}),
      scenario("NulByEscape", "duration_s: \"3\\0\"\n", {":1:", "NUL"}),
      scenario("NotUtf8", "gravity_m_s2: 9.81\nduration_s: \xff\n", {":2:", "0xff", "UTF-8"}),
      scenario("OverlongUtf8", "duration_s: \xc0\xaf\n", {":1:", "0xc0"}),
      scenario("Utf16",
               std::string("\xff\xfe"
                           "d\0u\0",
                           6),
               {":1:", "0xff"}),
      scenario("Tab", "camera:\n\ttd_s: 0\n", {":2:"}),
      scenario("OpenQuote", "duration_s: \"3\n", {"x.yaml:"}),
      scenario("OpenBracket", "imu: {gyro_bias_rad_s: [0, 0, 0}\n", {":1:"}),
      scenario("OpenBrace", "camera: {td_s: 0\n", {"x.yaml:"}),
      scenario("NoColon", "duration_s 3\n", {":1:"}),
      scenario("Indentation", "camera:\n   td_s: 0\n  readout_s: 0\n", {":3:"}),
      scenario("WindowsLineEnds", "gravity_m_s2: 9.81\r\nduraton_s: 3\r\n", {":2:", "duraton_s"}),
      scenario("OldMacLineEnds", "gravity_m_s2: 9.81\rduration_s: 3\r", {":1:", "0x0d"}),
      scenario("ByteOrderMark",
               "\xef\xbb\xbf"
               "duraton_s: 3\n",
               {":1:", "duraton_s"}),
      scenario("HugeFile",
               repeat("# a line of comment that fills the file, again and again and again and again\n", 250000),
               {"larger than"}),
      scenario("ManyNodes", std::string("a: [") + repeat("1,", 1100000) + "1]\n", {"x.yaml"}),
      scenario("ManyMarks", std::string("a: ") + repeat("[]", 1100000) + "\n", {"x.yaml"}),
  };
}

std::vector<Case> experiments() {
  const std::string sound = "scenario: scenario.yaml\n";
  return {
      experiment("NoSuchScenario", "scenario: nowhere.yaml\n", {":1:", "scenario", "nowhere.yaml"}),
      experiment("ScenarioIsAFolder", "scenario: data\n", {":1:", "scenario", "data"}),
      experiment("UnknownKeyOfExperiment", sound + "experiment: {trails: 3}\n",
                 {":2:", "experiment.trails", "did you mean 'trials'"}),
      experiment("NoTrials", sound + "experiment: {trials: 0}\n", {":2:", "experiment.trials"}),
      experiment("FractionalTrials", sound + "experiment: {trials: 2.5}\n", {":2:", "experiment.trials"}),
      experiment("NegativeSeed", sound + "experiment: {seed: -1}\n", {":2:", "experiment.seed"}),
      experiment("SeedOverflow", sound + "experiment: {seed: 18446744073709551616}\n", {":2:", "experiment.seed"}),
      experiment("ShareAboveOne", sound + "experiment: {max_failed_share: 2}\n", {":2:", "max_failed_share"}),
      experiment("NameWithSlash", sound + "experiment: {name: ../x}\n", {"experiment.name"}),
      experiment("AxesNotAMap", sound + "experiment: {axes: [1]}\n", {":2:", "experiment.axes"}),
      experiment("AxisWithoutValues", sound + "experiment: {axes: {scenario.camera.td_s: []}}\n",
                 {":2:", "scenario.camera.td_s"}),
      experiment("AxisIsNoList", sound + "experiment: {axes: {scenario.camera.td_s: 0.02}}\n",
                 {":2:", "scenario.camera.td_s", "list"}),
      experiment("AxisOfUnknownKey", sound + "experiment:\n  axes: {scenario.camera.td: [0]}\n",
                 {":3:", "scenario.camera.td", "td_s"}),
      experiment("AxisOfShortKey", sound + "experiment: {axes: {td_s: [0]}}\n", {":2:", "full key"}),
      experiment("AxisValueOutOfRange", sound + "experiment:\n  axes:\n    scenario.camera.td_s: [0, 0.1, 7]\n",
                 {":4:", "scenario.camera.td_s", "7"}),
      experiment("AxisOfUnknownRange", sound + "experiment:\n  axes: {scenario.camera.td_s: {linspce: [0, 1, 2]}}\n",
                 {":3:", "scenario.camera.td_s.linspce", "linspace"}),
      experiment("FilterOfUnknownAxis",
                 sound + "experiment:\n  axes: {scenario.camera.td_s: [0]}\n  skip: [{scenario.camera.td: 0}]\n",
                 {":4:", "experiment.skip.scenario.camera.td", "td_s"}),
      {"OnlyOfNoAxis",
       "run x.yaml --out out --only scenario.camera.td=0",
       "x.yaml",
       sound + "experiment: {axes: {scenario.camera.td_s: [0, 0.02]}}\n",
       {"--only scenario.camera.td=0: ", "td_s"}},
      {"PlanOutIsBelowAFile", "plan x.yaml --out poses.tum/a", "x.yaml", sound, {"poses.tum is not a folder"}},
      command("ExportOfNothing", "export-results nowhere --format csv --out out", {"nowhere/manifest.json"}),
      experiment("SetUnknownKey", sound + "set: {scenario.camera.readout: 0}\n", {":2:", "scenario.camera.readout"}),
      experiment("SetNotAMap", sound + "set: 3\n", {":2:", "set"}),
      experiment("Boolean", sound + "estimator: {estimate: {td: maybe}}\n",
                 {":2:", "estimator.estimate.td", "true or"}),
      experiment("EstimatorChoice", sound + "estimator: {type: bach}\n", {":2:", "estimator.type", "batch"}),
      {"NoNoiseToWeighWith",
       "run x.yaml --out out",
       "x.yaml",
       "scenario: {imu: {rate_hz: 100}}\n",
       {"estimator.imu.gyro_noise_density_rad_s_sqrt_hz"}},
      {"PriorWithoutWidth",
       "run x.yaml --out out",
       "x.yaml",
       sound + "set: {scenario.prior.td_sigma_s: 0}\n",
       {"x.yaml:2:", "scenario.prior.td_sigma_s"}},
      {"CameraInTheBatch",
       "run x.yaml --out out",
       "x.yaml",
       sound + "set: {estimator.estimate.intrinsics: true, scenario.prior.focal_sigma_px: 5}\n",
       {"x.yaml:2:", "estimator.estimate.intrinsics", "sliding_window"}},
      {"FocalLengthsThatAreNotKnown",
       "run x.yaml --out out",
       "x.yaml",
       sound + "set: {scenario.prior.focal_sigma_px: 50}\n",
       {"x.yaml:2:", "scenario.prior.focal_sigma_px", "tenth"}},
      command("NoSuchExperiment", "run nowhere.yaml --out out", {"nowhere.yaml"}),
      command("ExperimentIsAFolder", "run data --out out", {"data"}),
      command("SetWithoutValue", "simulate scenario.yaml --out out --set scenario.duration_s", {"--set"}),
      command("SetWithoutKey", "simulate scenario.yaml --out out --set =3", {"--set"}),
      command("SetKeyUnknown", "simulate scenario.yaml --out out --set scenario.duration=3",
              {"--set scenario.duration=3", "duration_s"}),
      command("SetValueOfWrongType", "simulate scenario.yaml --out out --set scenario.duration_s=x",
              {"--set scenario.duration_s=x", "number"}),
      command("SetBrokenYaml", "simulate scenario.yaml --out out --set 'scenario.imu={a: '", {"--set"}),
      command("OutIsNotEmpty", "simulate scenario.yaml --out data", {"data", "not an empty folder"}),
      {"RunOutIsAFile",
       "run x.yaml --out poses.tum",
       "x.yaml",
       sound + "experiment: {trials: 1}\n",
       {"poses.tum", "is not a folder"}},
      {"RunOutIsBelowAFile",
       "run x.yaml --out poses.tum/a/b",
       "x.yaml",
       sound + "experiment: {trials: 1}\n",
       {"poses.tum is not a folder"}},
      command("SimulateOutIsBelowAFile", "simulate scenario.yaml --out poses.tum/x", {"poses.tum is not a folder"}),
      command("EstimateOutIsBelowAFile", "estimate data --out poses.tum/x", {"poses.tum is not a folder"}),
      command("SimulateBaOutIsBelowAFile", "simulate-ba --out poses.tum/x", {"poses.tum is not a folder"}),
      command("ReplayOfNothing", "replay nowhere abc", {"nowhere/manifest.json"}),
  };
}

std::vector<Case> data_files() {
  return {
      poses("Unsorted", pose_lines("0.02 0 0 0 0 0 0 1"), {":3:"}),
      poses("RepeatedStamp", pose_lines("0.05 0 0 0 0 0 0 1"), {":3:"}),
      poses("TooFewColumns", pose_lines("0.1 0 0 0 0 0 0"), {":3:"}),
      poses("NotANumber", pose_lines("0.1 0 zero 0 0 0 0 1"), {":3:", "zero"}),
      poses("NanPosition", pose_lines("0.1 0 nan 0 0 0 0 1"), {":3:"}),
      poses("InfinitePosition", pose_lines("0.1 0 1e999 0 0 0 0 1"), {":3:"}),
      poses("NotAUnitQuaternionOfPose", pose_lines("0.1 0 0 0 0 0 0 0.5"), {":3:"}),
      poses("ZeroQuaternion", pose_lines("0.1 0 0 0 0 0 0 0"), {":3:"}),
      poses("StampOverflow", pose_lines("1e30 0 0 0 0 0 0 1"), {":3:"}),
      poses("BinaryPoses", std::string("\x00\x01\x02\x03", 4), {"poses.tum"}),
      poses("NoPoses", "# t x y z\n", {}),
      poses("Gap", pose_lines("0.1 0 0 0 0 0 0 1") + "9 0 0 0 0 0 0 1\n",
            {"spline.yaml:2:", "scenario.trajectory.largest_gap_s"}),
      poses("TooShort", pose_lines("0.1 0 0 0 0 0 0 1"), {"spline.yaml:2:", "scenario.trajectory.start_s"}),
      command("NoDataset", "estimate nowhere --out out", {"nowhere"}),
      command("DatasetIsAFile", "estimate poses.tum --out out", {"poses.tum"}),
      dataset("EmptyMeta", "meta.yaml", "", {}),
      dataset("OtherSchema", "meta.yaml", "schema: euroc\n", {}),
      dataset("PriorCutShort", "prior.yaml", "t_ns: 0\n", {"is missing"}),
      dataset("StampOverflows", "mav0/imu0/data.csv", kImuHead + "9223372036854775807,0,0,0,0,0,9.81\n",
              {":4:", "years"}),
      {"PriorOffTheImu",
       "estimate data --out out",
       "data/mav0/imu0/data.csv",
       "#\n1000,0,0,0,0,0,9.81\n20000000,0,0,0,0,0,9.81\n",
       {"data/prior.yaml", "t_ns"}},
      dataset("ImuRowCutShort", "mav0/imu0/data.csv", kImuHead + "40000000,0,0\n", {":4:", "columns"}),
      dataset("ImuUnsorted", "mav0/imu0/data.csv", kImuHead + "10000000,0,0,0,0,0,9.81\n", {":4:"}),
      dataset("ImuRepeatedStamp", "mav0/imu0/data.csv", kImuHead + "20000000,0,0,0,0,0,9.81\n", {":4:"}),
      dataset("ImuNan", "mav0/imu0/data.csv", kImuHead + "40000000,0,nan,0,0,0,9.81\n", {":4:", "nan"}),
      dataset("ImuText", "mav0/imu0/data.csv", kImuHead + "40000000,0,x,0,0,0,9.81\n", {":4:", "x"}),
      dataset("ImuStampInSeconds", "mav0/imu0/data.csv", kImuHead + "0.04,0,0,0,0,0,9.81\n", {":4:", "0.04"}),
      dataset("ImuEmpty", "mav0/imu0/data.csv", "", {}),
      dataset("ImuBinary", "mav0/imu0/data.csv", std::string("\x00\x01,\x02\n", 5), {":1:"}),
      dataset("PointOfNoFrame", "mav0/cam0/points.csv", "1,0,10,10\n", {":1:", "frame 1"}),
      dataset("PointNan", "mav0/cam0/points.csv", "300000000,0,nan,10\n", {":1:"}),
      dataset("FrameStampsUnsorted", "mav0/cam0/data.csv", "400000000\n300000000\n", {":2:"}),
      dataset("CameraWithoutFocalLength", "mav0/cam0/sensor.yaml", "width_px: 640\nheight_px: 480\n", {"is missing"}),
      dataset("NegativeNoise", "mav0/imu0/sensor.yaml",
              "gyroscope_noise_density: -1\ngyroscope_random_walk: 1\naccelerometer_noise_density: "
              "1\naccelerometer_random_walk: 1\n",
              {":1:", "gyroscope_noise_density"}),
      dataset("TrackTwiceInAFrame", "mav0/cam0/points.csv", "300000000,7,10,10\n300000000,7,11,10\n",
              {":2:", "track 7"}),
      dataset("LineOfNoFrame", "mav0/cam0/lines.csv", "1,0,10,10,50,50\n", {":1:", "frame 1"}),
      dataset("LineRowCutShort", "mav0/cam0/lines.csv", "300000000,0,10,10,50\n", {":1:", "columns"}),
      dataset("LineNan", "mav0/cam0/lines.csv", "300000000,0,10,10,nan,50\n", {":1:", "nan"}),
      dataset("LineWithHalfItsVelocities", "mav0/cam0/lines.csv", "300000000,0,10,10,50,50,1,1,,\n", {":1:"}),
      dataset("LineTrackTwiceInAFrame", "mav0/cam0/lines.csv", "300000000,7,10,10,50,50\n300000000,7,11,10,50,50\n",
              {":2:", "track 7"}),
      edited("NegativeLineNoise", "mav0/cam0/sensor.yaml", "line_sigma_px: 1", "line_sigma_px: -1", {"line_sigma_px"}),
      edited("PriorAfterTheFirstFrame", "prior.yaml", "t_ns: 0", "t_ns: 500000000", {":1:", "t_ns", "first frame"}),
      edited("ImuBeyondPhysics", "mav0/imu0/data.csv", "\n20000000,", "\n20000000,1e200,0,0,0,0,9.81\n20000001,",
             {":3:", "rad/s"}),
      {.name = "TinyNoiseDensity",
       .arguments = "estimate data --out out",
       .file = "data/mav0/imu0/sensor.yaml",
       .text = "gyroscope_noise_density: 1e-200",
       .says = {"gyro_noise_density", "1e-12"},
       .replaces = "gyroscope_noise_density: 0.001"},
      command("NoEstimate", "evaluate nowhere.tum --truth poses.tum", {"nowhere.tum"}),
      command("NoTruth", "evaluate poses.tum --truth nowhere.tum", {"nowhere.tum"}),
      {"TruthUnsorted",
       "evaluate poses.tum --truth truth.tum",
       "truth.tum",
       pose_lines("0.02 0 0 0 0 0 0 1"),
       {"truth.tum:3:"}},
      {"EstimateBinary",
       "evaluate estimate.tum --truth poses.tum",
       "estimate.tum",
       std::string("\x00\xff", 2),
       {"estimate.tum"}},
  };
}

std::string case_name(const ::testing::TestParamInfo<Case>& info) { return info.param.name; }
INSTANTIATE_TEST_SUITE_P(KeysAndValues, Malformed, ::testing::ValuesIn(keys_and_values()), case_name);
INSTANTIATE_TEST_SUITE_P(BeyondPhysics, Malformed, ::testing::ValuesIn(beyond_physics()), case_name);
INSTANTIATE_TEST_SUITE_P(Syntax, Malformed, ::testing::ValuesIn(syntax()), case_name);
INSTANTIATE_TEST_SUITE_P(Experiments, Malformed, ::testing::ValuesIn(experiments()), case_name);
INSTANTIATE_TEST_SUITE_P(DataFiles, Malformed, ::testing::ValuesIn(data_files()), case_name);

}  // namespace
}  // namespace plumbline
