#include <cmath>
#include <cstdint>
#include <map>
#include <vector>

#include <gtest/gtest.h>

#include "core/time.h"
#include "sim/camera_sensor.h"
#include "sim/frame_view.h"
#include "sim/simulate.h"
#include "sim/track_velocity.h"
#include "sim/world.h"

namespace plumbline::sim {
namespace {

constexpr core::TrialId kId{.seed = 1, .trial = 0};
constexpr core::PinholeCamera kCamera{
    .width_px = 640, .height_px = 480, .fx_px = 400.0, .fy_px = 500.0, .cx_px = 320.0, .cy_px = 240.0};

ScenarioConfig some_config(VelocitySource source) {
  ScenarioConfig config;
  config.duration_s = 4.0;
  config.trajectory.handheld = {.speed_rms_m_s = 0.7, .rate_rms_rad_s = 0.75};
  config.camera.td_s = 0.02;
  config.camera.readout_s = 0.03;
  config.camera.pixel_sigma_px = 0.0;
  config.world.landmarks = 1000;
  config.prior.means = PriorMeans::kTruth;
  config.points.velocity_source = source;
  return config;
}

core::PointObservation at(std::int64_t track, double u, double v) {
  core::PointObservation point;
  point.track_id = track;
  point.pixel = {u, v};
  return point;
}

TEST(ImageVelocity, ByHand) {
  // 40 columns and 96 rows further after 50 ms: a fifth of the picture's height, so 6 ms of the readout of 30 ms.
  std::vector<core::Frame> frames = {
      {1'000'000'000, {at(7, 320.0, 240.0)}},
      {1'050'000'000, {at(7, 360.0, 336.0), at(8, 100.0, 100.0)}},
      {1'100'000'000, {at(7, 360.0, 240.0)}},
      {1'150'000'000, {at(9, 360.0, 240.0)}},
  };
  add_finite_difference_velocities(frames, kCamera, 0.03);
  const Eigen::Vector2d second(0.1 / 0.056, 0.192 / 0.056);
  ASSERT_TRUE(frames[1].points[0].velocity.has_value());
  EXPECT_LT((*frames[1].points[0].velocity - second).norm(), 1e-12);
  EXPECT_EQ(frames[0].points[0].velocity, frames[1].points[0].velocity);  // forward difference
  const Eigen::Vector2d third(0.0, -0.192 / 0.044);                       // upwards: the rows come closer in time
  EXPECT_LT((*frames[2].points[0].velocity - third).norm(), 1e-12);
  EXPECT_FALSE(frames[1].points[1].velocity.has_value());  // tracks of one observation
  EXPECT_FALSE(frames[3].points[0].velocity.has_value());
}

TEST(ImageVelocity, ATrackThatSkipsAFrameStartsAnew) {
  std::vector<core::Frame> frames = {{1'000'000'000, {at(7, 320.0, 240.0)}},
                                     {1'050'000'000, {}},
                                     {1'100'000'000, {at(7, 330.0, 240.0)}},
                                     {1'150'000'000, {at(7, 350.0, 240.0)}}};
  add_finite_difference_velocities(frames, kCamera, 0.0);
  EXPECT_FALSE(frames[0].points[0].velocity.has_value());
  EXPECT_LT((*frames[2].points[0].velocity - Eigen::Vector2d(1.0, 0.0)).norm(), 1e-12);
  EXPECT_LT((*frames[3].points[0].velocity - Eigen::Vector2d(1.0, 0.0)).norm(), 1e-12);
}

// Against fourth-order differences of the noise-free projection about the very instant of the exposure.
TEST(ImageVelocity, ExactIsTheDerivativeAtTheExposure) {
  const ScenarioConfig config = some_config(VelocitySource::kExact);
  const auto trajectory = make_trajectory(config.trajectory, config.duration_s, kId);
  const auto landmarks = make_world(config, *trajectory, kId).points_W;
  const core::RigCalibration calibration = config.calibration();
  const CameraRecording recording = simulate_camera(*trajectory, landmarks, config, 0.25, kId);
  const auto normalised = [&](double t_s, int landmark) -> Eigen::Vector2d {
    const core::Pose T_W_C = trajectory->pose_at(t_s) * calibration.T_B_C;
    const Eigen::Vector3d P_C = T_W_C.inverse() * landmarks[static_cast<std::size_t>(landmark)];
    return P_C.head<2>() / P_C.z();
  };
  constexpr double kStepS = 1e-3;
  double other_row2 = 0.0;
  int n = 0;
  for (const core::Frame& frame : recording.frames) {
    const double t_middle_s = core::to_seconds(frame.t_cam_ns) + calibration.td_s;
    for (const core::PointObservation& point : frame.points) {
      const int landmark = recording.track_landmark.at(point.track_id);
      const auto numeric = [&](double t_s) -> Eigen::Vector2d {
        const auto x = [&](double steps) { return normalised(t_s + steps * kStepS, landmark); };
        return (8.0 * (x(1.0) - x(-1.0)) - (x(2.0) - x(-2.0))) / (12.0 * kStepS);
      };
      const double row_s = core::row_phase(point.pixel.y(), 480) * calibration.readout_s;
      ASSERT_TRUE(point.velocity.has_value());
      // Step^4 x^(5)/30 of motions below 2 Hz (12.6 rad/s): 1e-12 * 12.6^5 / 30 = 1e-8; rounding 1e-16/1e-3.
      EXPECT_LT((*point.velocity - numeric(t_middle_s + row_s)).norm(), 1e-7);
      other_row2 += (*point.velocity - numeric(t_middle_s)).squaredNorm();
      ++n;
    }
  }
  ASSERT_GT(n, 1000);
  EXPECT_GT(std::sqrt(other_row2 / n), 1e-3);  // of the middle row instead
}

// Without noise a finite difference is the mean velocity between two rows, which the mean of the two exact ones equals
// but for dt^2/12 of the third derivative. By the interval of the frames it is not.
TEST(ImageVelocity, FiniteDifferencesAreBetweenRows) {
  const auto exact = simulate(some_config(VelocitySource::kExact), kId).measurements.frames;
  const auto differences = simulate(some_config(VelocitySource::kFiniteDifference), kId).measurements.frames;
  ASSERT_EQ(exact.size(), differences.size());
  std::map<std::int64_t, core::PointObservation> before;
  double by_rows2 = 0.0;
  double by_frames2 = 0.0;
  for (std::size_t i = 0; i < exact.size(); ++i) {
    std::map<std::int64_t, core::PointObservation> now;
    for (std::size_t j = 0; j < exact[i].points.size(); ++j) {
      const core::PointObservation& point = exact[i].points[j];
      ASSERT_EQ(point.track_id, differences[i].points[j].track_id);
      ASSERT_EQ(point.pixel, differences[i].points[j].pixel);
      now[point.track_id] = point;
      const auto last = before.find(point.track_id);
      if (last == before.end()) continue;
      const Eigen::Vector2d mean = 0.5 * (*point.velocity + *last->second.velocity);
      const Eigen::Vector2d found = differences[i].points[j].velocity.value();
      const double rows_s = (point.pixel.y() - last->second.pixel.y()) / 480 * 0.03;
      by_rows2 += (found - mean).squaredNorm();
      by_frames2 += (found * ((0.05 + rows_s) / 0.05) - mean).squaredNorm();
    }
    before = std::move(now);
  }
  EXPECT_LT(by_rows2, 0.1 * by_frames2);
}

TEST(ImageVelocity, SourceChangesNothingElse) {
  const auto none = simulate(some_config(VelocitySource::kNone), kId).measurements.frames;
  for (const VelocitySource source : {VelocitySource::kExact, VelocitySource::kFiniteDifference}) {
    const auto frames = simulate(some_config(source), kId).measurements.frames;
    ASSERT_EQ(frames.size(), none.size());
    for (std::size_t i = 0; i < frames.size(); ++i) {
      ASSERT_EQ(frames[i].t_cam_ns, none[i].t_cam_ns);
      ASSERT_EQ(frames[i].points.size(), none[i].points.size());
      for (std::size_t j = 0; j < frames[i].points.size(); ++j) {
        EXPECT_EQ(frames[i].points[j].track_id, none[i].points[j].track_id);
        EXPECT_EQ(frames[i].points[j].pixel, none[i].points[j].pixel);
        EXPECT_FALSE(none[i].points[j].velocity.has_value());
      }
    }
  }
}

}  // namespace
}  // namespace plumbline::sim
