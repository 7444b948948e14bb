// Every scenario of configs/scenarios: it says what it is for, and simulates what it says.
#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "data_folder.h"
#include "sim/frame_view.h"
#include "sim/imu_sensor.h"
#include "sim/simulate.h"
#include "tools/experiment.h"

namespace plumbline {
namespace {

namespace fs = std::filesystem;

constexpr core::TrialId kId{.seed = 1, .trial = 0};

std::vector<fs::path> scenario_files() {
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(fs::path(PLUMBLINE_SOURCE_DIR) / "configs/scenarios")) {
    files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

fs::path recorded_poses() { return data_folder() / "trajectories/euroc_V1_01_easy.txt"; }

std::string read(const fs::path& file) {
  std::ifstream in(file);
  return {std::istreambuf_iterator<char>(in), {}};
}

// Shorter than the file says, so that all of them take seconds.
constexpr double kDurationS = 8.0;

class Scenario : public testing::TestWithParam<fs::path> {
 protected:
  void SetUp() override {
    std::vector<std::string> set = {"scenario.duration_s=8"};
    const std::string text = read(GetParam());
    const bool needs_poses = text.find("type: spline") != std::string::npos;
    if (needs_poses && !fs::exists(recorded_poses())) GTEST_SKIP() << recorded_poses() << " is absent (PLUMBLINE_DATA)";
    if (needs_poses) set.push_back("scenario.trajectory.file=" + recorded_poses().string());
    config_ = tools::load_scenario(GetParam(), set);
    trajectory_ = sim::make_trajectory(config_.trajectory, kDurationS, kId);
  }

  sim::ScenarioConfig config_;
  std::unique_ptr<const sim::Trajectory> trajectory_;
};

TEST_P(Scenario, OpensWithASentenceOnWhatItIsFor) {
  std::istringstream lines(read(GetParam()));
  std::string comment;  // as one line
  for (std::string line; std::getline(lines, line) && line.starts_with("# ");) comment += line.substr(1);
  ASSERT_GT(comment.size(), 40U);
  EXPECT_TRUE(std::isupper(static_cast<unsigned char>(comment[1])) != 0) << comment;
  EXPECT_TRUE(comment.ends_with('.')) << comment;
}

core::State integrated(const std::vector<core::ImuSample>& samples, std::size_t from, std::size_t to, core::State x,
                       double gravity_m_s2) {
  const Eigen::Vector3d g_W(0.0, 0.0, -gravity_m_s2);
  for (std::size_t i = from; i < to; ++i) {
    const core::ImuSample& a = samples[i];
    const core::ImuSample& b = samples[i + 1];
    const double dt = core::to_seconds(b.t_ns - a.t_ns);
    const Eigen::Quaterniond q = x.T_W_B.q * core::exp_quaternion(0.5 * dt * (a.gyro_rad_s + b.gyro_rad_s));
    const Eigen::Vector3d a_W = 0.5 * (x.T_W_B.q * a.accel_m_s2 + q * b.accel_m_s2) + g_W;
    x.T_W_B = {q, x.T_W_B.p + dt * x.v_W + 0.5 * dt * dt * a_W};
    x.v_W += dt * a_W;
  }
  return x;
}

// The noise-free sensor at the scenario's rate and at twice that, integrated by the midpoint rule for a second from
// several instants. The rule is of second order: the error falls to a quarter, or is at the floor of the nanosecond
// stamps. Below 1 mm and 1 mrad it is small beside what any estimator attains.
TEST_P(Scenario, ImuIntegratesToTheTruth) {
  const auto error = [&](double rate_hz) {
    sim::ImuConfig ideal;
    ideal.rate_hz = rate_hz;
    const auto samples = sim::simulate_imu(*trajectory_, ideal, config_.gravity_m_s2, kDurationS, kId).samples;
    const auto n = static_cast<std::size_t>(std::lround(rate_hz));
    double worst = 0.0;
    for (const std::size_t from : {std::size_t{0}, 3 * n, 6 * n}) {
      const sim::Kinematics start = trajectory_->at(core::to_seconds(samples[from].t_ns));
      const sim::Kinematics end = trajectory_->at(core::to_seconds(samples[from + n].t_ns));
      const core::State x = integrated(samples, from, from + n, {.T_W_B = start.T_W_B, .v_W = start.v_W, .bias = {}},
                                       config_.gravity_m_s2);
      worst = std::max(
          {worst, (x.T_W_B.p - end.T_W_B.p).norm(), core::rotation_angle(x.T_W_B.q.conjugate() * end.T_W_B.q)});
    }
    return worst;
  };
  const double coarse = error(config_.imu.rate_hz);
  const double fine = error(2.0 * config_.imu.rate_hz);
  EXPECT_LT(coarse, 1e-3);
  EXPECT_TRUE(fine < 1e-8 || fine < coarse / 3.0) << coarse << ' ' << fine;
}

double median(std::vector<double> x) {
  const auto middle = x.begin() + static_cast<std::ptrdiff_t>(x.size() / 2);
  std::nth_element(x.begin(), middle, x.end());
  return *middle;
}

TEST_P(Scenario, ObservationsAreOfTheTruthAndPlenty) {
  const sim::Simulation simulation = sim::simulate(config_, kId);
  const auto& frames = simulation.measurements.frames;
  const auto& imu = simulation.measurements.imu;
  const auto not_later = [](core::TimeNs a, core::TimeNs b) { return a >= b; };
  EXPECT_EQ(std::ranges::adjacent_find(imu, not_later, &core::ImuSample::t_ns), imu.end());
  EXPECT_EQ(std::ranges::adjacent_find(frames, not_later, &core::Frame::t_cam_ns), frames.end());
  ASSERT_GT(frames.size(), 50U);

  const core::RigCalibration calibration = config_.calibration();
  const double half_angle_rad = sim::half_angle_of_view_rad(config_.camera.model);
  std::vector<double> errors2;  // in sigmas
  for (std::size_t k = 0; k < frames.size(); k += 5) {
    const sim::FrameView view(*trajectory_, config_.camera.model, calibration, half_angle_rad,
                              core::to_seconds(frames[k].t_cam_ns));
    EXPECT_GE(frames[k].points.size() + 2 * frames[k].lines.size(), 20U) << k;  // a line is two ends
    for (const auto& point : frames[k].points) {
      const int landmark = simulation.truth.track_landmark.at(point.track_id);
      const auto exposure = view.expose(simulation.truth.landmarks_W[static_cast<std::size_t>(landmark)]);
      ASSERT_TRUE(exposure.has_value());
      errors2.push_back((point.pixel - exposure->pixel).squaredNorm() / std::pow(config_.camera.pixel_sigma_px, 2));
    }
  }
  EXPECT_GT(static_cast<double>(errors2.size()),
            0.8 * config_.points.per_frame * std::ceil(static_cast<double>(frames.size()) / 5.0));
  // The median of chi-square with 2 degrees of freedom is 2 ln 2, that of n values has the deviation 2 / sqrt(n). A few
  // per cent of outliers move it by 3 %. Heavy tails and stamps that jitter have no such figure, but stay near.
  const bool gaussian = !config_.camera.pixel_noise_dof && config_.camera.stamp_jitter_s == 0.0;
  if (gaussian) {
    const double tolerance = 0.1 * 2.0 * std::log(2.0) + 4.5 * 2.0 / std::sqrt(static_cast<double>(errors2.size()));
    EXPECT_NEAR(median(errors2), 2.0 * std::log(2.0), tolerance);
  } else {
    EXPECT_LT(median(errors2), 9.0);
  }
}

// The scenarios' lines are as many as they ask for, and of segments in the picture.
TEST_P(Scenario, LinesAreOfTheTruthAndPlenty) {
  if (config_.lines.per_frame == 0) GTEST_SKIP() << "has no lines";
  const sim::Simulation simulation = sim::simulate(config_, kId);
  std::vector<double> errors2;  // in sigmas
  auto ends = simulation.truth.line_ends.begin();
  for (const core::Frame& frame : simulation.measurements.frames) {
    for (const core::LineObservation& line : frame.lines) {
      ASSERT_EQ(ends->track_id, line.track_id);
      for (const std::size_t k : {std::size_t{0}, std::size_t{1}}) {
        EXPECT_TRUE(ends->ends_px[k].x() > -0.51 && ends->ends_px[k].x() < config_.camera.model.width_px - 0.49);
        errors2.push_back((line.ends_px[k] - ends->ends_px[k]).squaredNorm() / std::pow(config_.lines.sigma_px, 2));
      }
      ++ends;
    }
  }
  const auto frames = static_cast<double>(simulation.measurements.frames.size());
  EXPECT_GT(0.5 * static_cast<double>(errors2.size()), 0.8 * config_.lines.per_frame * frames);
  EXPECT_NEAR(median(errors2), 2.0 * std::log(2.0), 4.5 * 2.0 / std::sqrt(static_cast<double>(errors2.size())));
}

INSTANTIATE_TEST_SUITE_P(Files, Scenario, testing::ValuesIn(scenario_files()),
                         [](const auto& file) { return file.param.stem().string(); });

TEST(Scenarios, AreMany) { EXPECT_GE(scenario_files().size(), 15U); }

}  // namespace
}  // namespace plumbline
