#include "sim/camera_sensor.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <memory>
#include <set>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "core/time.h"
#include "sim/frame_view.h"
#include "sim/world.h"

namespace plumbline::sim {
namespace {

constexpr core::TrialId kId{.seed = 1, .trial = 0};
constexpr double kLeadS = 0.25;

// Strong motion, so that a millisecond is worth more than half a pixel; no noise.
ScenarioConfig some_config() {
  ScenarioConfig config;
  config.duration_s = 4.0;
  config.trajectory.handheld = {.speed_rms_m_s = 0.7, .rate_rms_rad_s = 0.75};
  config.camera.td_s = 0.02;
  config.camera.pixel_sigma_px = 0.0;
  config.world.landmarks = 1000;
  return config;
}

struct Scene {
  ScenarioConfig config;
  std::unique_ptr<const Trajectory> trajectory;
  World world;
  std::vector<Eigen::Vector3d> landmarks;
  core::RigCalibration calibration;
  CameraRecording recording;

  explicit Scene(const ScenarioConfig& c, core::TrialId id = kId)
      : config(c),
        trajectory(make_trajectory(c.trajectory, c.duration_s, id)),
        world(make_world(c, *trajectory, id)),
        landmarks(world.points_W),
        calibration(c.calibration()),
        recording(simulate_camera(*trajectory, world, c, kLeadS, id)) {}

  int landmark_of(const core::PointObservation& point) const { return recording.track_landmark.at(point.track_id); }

  Eigen::Vector3d in_camera(double t_imu_s, int landmark) const {
    return (trajectory->pose_at(t_imu_s) * calibration.T_B_C).inverse() * landmarks[static_cast<std::size_t>(landmark)];
  }
  // NaN behind the camera.
  Eigen::Vector2d pixel_at(double t_imu_s, int landmark) const {
    const Eigen::Vector2d none = Eigen::Vector2d::Constant(std::nan(""));
    return config.camera.model.project(in_camera(t_imu_s, landmark)).value_or(none);
  }

  FrameView view(double t_cam_s) const {
    const core::PinholeCamera& camera = config.camera.model;
    return {*trajectory, camera, calibration, half_angle_of_view_rad(camera), t_cam_s};
  }

  template <class F>
  void for_each_point(const F& f) const {
    for (const core::Frame& frame : recording.frames) {
      for (const core::PointObservation& point : frame.points) f(frame, point);
    }
  }
};

// The observations by frame and landmark, whatever their tracks are called.
std::map<std::pair<core::TimeNs, int>, Eigen::Vector2d> by_landmark(const Scene& scene) {
  std::map<std::pair<core::TimeNs, int>, Eigen::Vector2d> pixels;
  scene.for_each_point([&](const core::Frame& frame, const core::PointObservation& point) {
    pixels[{frame.t_cam_ns, scene.landmark_of(point)}] = point.pixel;
  });
  return pixels;
}

// The standard score of a chi-square variable, by Wilson and Hilferty. |score| < 4.5 fails by chance in 7e-6 of cases.
constexpr double kLargestScore = 4.5;
double chi_square_score(double x, double dof) {
  return (std::cbrt(x / dof) - 1.0 + 2.0 / (9.0 * dof)) / std::sqrt(2.0 / (9.0 * dof));
}

// t_imu = t_cam + td
TEST(CameraSensor, FrameShowsTheWorldAtItsStampPlusTd) {
  const Scene scene(some_config());
  double flipped2 = 0.0;
  int n = 0;
  scene.for_each_point([&](const core::Frame& frame, const core::PointObservation& point) {
    const double t_cam = core::to_seconds(frame.t_cam_ns);
    const int landmark = scene.landmark_of(point);
    EXPECT_LT((point.pixel - scene.pixel_at(t_cam + 0.02, landmark)).norm(), 1e-9);
    flipped2 += (point.pixel - scene.pixel_at(t_cam - 0.02, landmark)).squaredNorm();
    ++n;
  });
  ASSERT_GT(n, 1000);
  EXPECT_GT(std::sqrt(flipped2 / n), 5.0);  // with the other sign
}

// The row solve against bisection of t = t_cam + td + (h_v(t) - rows/2) readout/rows.
TEST(CameraSensor, RowTimeIsExact) {
  ScenarioConfig config = some_config();
  config.camera.readout_s = 0.03;
  const Scene scene(config);
  const int rows = config.camera.model.height_px;
  double flipped2 = 0.0;
  int n = 0;
  scene.for_each_point([&](const core::Frame& frame, const core::PointObservation& point) {
    const int landmark = scene.landmark_of(point);
    const double t_middle = core::to_seconds(frame.t_cam_ns) + 0.02;
    const auto row_time = [&](double v) { return t_middle + (v - 0.5 * rows) * 0.03 / rows; };
    double before = t_middle - 0.03;
    double after = t_middle + 0.03;
    while (after - before > 1e-11) {
      const double t = 0.5 * (before + after);
      (t < row_time(scene.pixel_at(t, landmark).y()) ? before : after) = t;
    }
    EXPECT_LT(std::abs(row_time(point.pixel.y()) - before), 1e-10);
    // What the row shows is the world at its own time; 1e-10 s is worth less than 1e-6 px.
    EXPECT_LT((point.pixel - scene.pixel_at(before, landmark)).norm(), 1e-6);
    flipped2 += (point.pixel - scene.pixel_at(2.0 * t_middle - before, landmark)).squaredNorm();
    ++n;
  });
  ASSERT_GT(n, 1000);
  EXPECT_GT(std::sqrt(flipped2 / n), 2.0);  // if rows were read from the bottom up
}

TEST(CameraSensor, LaterRowsAreExposedLater) {
  ScenarioConfig config = some_config();
  config.camera.readout_s = 0.03;
  const Scene scene(config);
  const FrameView view = scene.view(1.0);
  std::vector<Exposure> exposures;
  for (const Eigen::Vector3d& P_W : scene.landmarks) {
    const auto exposure = view.expose(P_W);
    if (exposure && config.camera.model.contains(exposure->pixel)) exposures.push_back(*exposure);
  }
  ASSERT_GT(exposures.size(), 20U);
  std::ranges::sort(exposures, {}, [](const Exposure& e) { return e.pixel.y(); });
  EXPECT_LT(exposures.front().t_imu_s, 1.02);  // above the middle row
  EXPECT_GT(exposures.back().t_imu_s, 1.02);
  for (std::size_t i = 1; i < exposures.size(); ++i) {
    const double dv = exposures[i].pixel.y() - exposures[i - 1].pixel.y();
    EXPECT_NEAR(exposures[i].t_imu_s - exposures[i - 1].t_imu_s, dv * 0.03 / 480, 2e-12);
  }
}

TEST(CameraSensor, GlobalShutterExposesAllRowsAtOnce) {
  const Scene scene(some_config());
  const FrameView view = scene.view(1.0);
  int n = 0;
  for (const Eigen::Vector3d& P_W : scene.landmarks) {
    const auto exposure = view.expose(P_W);
    if (!exposure) continue;
    EXPECT_EQ(exposure->t_imu_s, 1.0 + 0.02);
    ++n;
  }
  EXPECT_GT(n, 100);
}

TEST(CameraSensor, ReferenceRowIsAMatterOfNotation) {
  ScenarioConfig first = some_config();
  first.camera.readout_s = 0.03;
  first.camera.td_reference_row = core::RowReference::kFirst;
  first.camera.td_s = 0.005;
  ScenarioConfig middle = first;
  middle.camera.td_reference_row = core::RowReference::kMiddle;
  middle.camera.td_s = 0.005 + 0.5 * 0.03;
  const auto a = by_landmark(Scene(first));
  EXPECT_GT(a.size(), 1000U);
  EXPECT_EQ(a, by_landmark(Scene(middle)));
  middle.camera.td_s = 0.005;
  EXPECT_NE(a, by_landmark(Scene(middle)));
}

// Noise of sigma 5 pixels, so that much of it crosses the border: what it hits within 5 pixels of a border lands
// outside as often as a normal does.
TEST(CameraSensor, PixelNoiseIsNormalAndNotTruncated) {
  ScenarioConfig config = some_config();
  const auto ideal = by_landmark(Scene(config));
  config.camera.pixel_sigma_px = 5.0;
  const auto noisy = by_landmark(Scene(config));
  ASSERT_EQ(noisy.size(), ideal.size());

  double sum2 = 0.0;
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  double product = 0.0;
  double outward = 0.0;
  double outward2 = 0.0;
  double near_border = 0.0;
  int outside = 0;
  for (const auto& [key, pixel] : noisy) {
    const Eigen::Vector2d& clean = ideal.at(key);
    const Eigen::Vector2d e = (pixel - clean) / 5.0;
    sum += e;
    sum2 += e.squaredNorm();
    product += e.x() * e.y();
    if (!config.camera.model.contains(pixel)) ++outside;
    const double left = clean.x() + 0.5;
    const double right = config.camera.model.width_px - 0.5 - clean.x();
    if (std::min(left, right) < 10.0) {
      const double out = left < right ? -e.x() : e.x();
      outward += out;
      outward2 += out * out;
      near_border += 1.0;
    }
  }
  const auto n = static_cast<double>(noisy.size());
  EXPECT_LT(std::abs(chi_square_score(sum2, 2.0 * n)), kLargestScore);
  EXPECT_LT(sum.cwiseAbs().maxCoeff() / std::sqrt(n), kLargestScore);
  EXPECT_LT(std::abs(product) / std::sqrt(n), kLargestScore);
  ASSERT_GT(near_border, 50.0);
  EXPECT_GT(outside, 20);
  EXPECT_LT(std::abs(outward) / std::sqrt(near_border), kLargestScore);
  EXPECT_LT(std::abs(chi_square_score(outward2, near_border)), kLargestScore);
}

// Which landmarks a frame may hold, by brute force over all of them.
TEST(CameraSensor, SeesWhatIsInThePictureAndInRange) {
  ScenarioConfig config = some_config();
  config.camera.readout_s = 0.03;
  config.points.per_frame = 100000;
  config.points.nearest_m = 2.0;
  config.points.farthest_m = 5.0;
  const Scene scene(config);
  for (const core::Frame& frame : scene.recording.frames) {
    std::set<int> seen;
    for (const core::PointObservation& point : frame.points) {
      EXPECT_TRUE(seen.insert(scene.landmark_of(point)).second) << "twice in a frame";
    }
    std::set<int> expected;
    const FrameView view = scene.view(core::to_seconds(frame.t_cam_ns));
    for (int i = 0; i < config.world.landmarks; ++i) {
      const auto exposure = view.expose(scene.landmarks[static_cast<std::size_t>(i)]);
      if (!exposure || !config.camera.model.contains(exposure->pixel)) continue;
      EXPECT_NEAR(exposure->depth_m, scene.in_camera(exposure->t_imu_s, i).z(), 1e-12);
      if (exposure->depth_m >= 2.0 && exposure->depth_m <= 5.0) expected.insert(i);
    }
    EXPECT_EQ(seen, expected);
    EXPECT_GT(seen.size(), 10U);
  }
}

TEST(CameraSensor, HoldsAsManyPointsAsAllowed) {
  ScenarioConfig config = some_config();
  config.points.per_frame = 100000;
  const Scene all(config);
  config.points.per_frame = 30;
  const Scene cut(config);
  ASSERT_EQ(cut.recording.frames.size(), all.recording.frames.size());
  for (std::size_t i = 0; i < cut.recording.frames.size(); ++i) {
    EXPECT_EQ(cut.recording.frames[i].points.size(), std::min<std::size_t>(30, all.recording.frames[i].points.size()));
  }
}

// The frames of each track, by index.
std::map<std::int64_t, std::vector<int>> frames_of_tracks(const Scene& scene) {
  std::map<std::int64_t, std::vector<int>> frames;
  for (int i = 0; i < std::ssize(scene.recording.frames); ++i) {
    for (const core::PointObservation& point : scene.recording.frames[static_cast<std::size_t>(i)].points) {
      frames[point.track_id].push_back(i);
    }
  }
  return frames;
}

TEST(CameraSensor, TracksAreUnbrokenAndBounded) {
  ScenarioConfig config = some_config();
  const Scene unbounded(config);
  config.points.longest_track_frames = 7;
  const Scene bounded(config);
  for (const Scene* scene : {&unbounded, &bounded}) {
    const auto tracks = frames_of_tracks(*scene);
    EXPECT_EQ(tracks.size(), scene->recording.track_landmark.size());
    std::size_t longest = 0;
    for (const auto& [id, frames] : tracks) {
      EXPECT_EQ(frames.back() - frames.front() + 1, std::ssize(frames)) << "gap or repetition in track " << id;
      longest = std::max(longest, frames.size());
    }
    if (scene == &bounded) {
      EXPECT_EQ(longest, 7U);
    } else {
      EXPECT_GT(longest, 7U);
    }
  }
}

// With no limit on the points, a track that is lost while its landmark stays in view starts again under a new number
// in the same frame, so that losses can be counted.
TEST(CameraSensor, TracksAreLostAtTheConfiguredRate) {
  ScenarioConfig config = some_config();
  config.points.per_frame = 100000;
  config.points.loss_probability = 0.1;
  const Scene scene(config);
  double kept = 0.0;
  double lost = 0.0;
  std::map<int, std::int64_t> last;  // landmark to track
  for (const core::Frame& frame : scene.recording.frames) {
    std::map<int, std::int64_t> now;
    for (const core::PointObservation& point : frame.points) {
      const int landmark = scene.landmark_of(point);
      now[landmark] = point.track_id;
      const auto before = last.find(landmark);
      if (before != last.end()) (before->second == point.track_id ? kept : lost) += 1.0;
    }
    last = std::move(now);
  }
  const double n = kept + lost;
  ASSERT_GT(n, 2000.0);
  EXPECT_LT(std::abs(lost - 0.1 * n) / std::sqrt(n * 0.1 * 0.9), kLargestScore);
  EXPECT_EQ(frames_of_tracks(scene).size(), scene.recording.track_landmark.size());
}

// Each defect draws from its own stream: the pixel noise of a landmark in a frame is the same whichever tracks exist.
TEST(CameraSensor, NoiseDoesNotDependOnTheTracks) {
  ScenarioConfig config = some_config();
  const auto ideal = by_landmark(Scene(config));
  config.camera.pixel_sigma_px = 1.0;
  const auto reference = by_landmark(Scene(config));
  const auto expect_same_noise = [&](const ScenarioConfig& changed) {
    int common = 0;
    for (const auto& [key, pixel] : by_landmark(Scene(changed))) {
      const auto same = reference.find(key);
      if (same == reference.end()) continue;
      const Eigen::Vector2d& clean = ideal.at(key);
      // Rounding of pixels.
      EXPECT_LT(((pixel - clean) / changed.camera.pixel_sigma_px - (same->second - clean)).norm(), 1e-12);
      ++common;
    }
    EXPECT_GT(common, 500);
  };
  ScenarioConfig louder = config;
  louder.camera.pixel_sigma_px = 4.0;
  expect_same_noise(louder);
  ScenarioConfig lossy = config;
  lossy.points.loss_probability = 0.2;
  expect_same_noise(lossy);
  ScenarioConfig fewer = config;
  fewer.points.per_frame = 20;
  expect_same_noise(fewer);
}

}  // namespace
}  // namespace plumbline::sim
