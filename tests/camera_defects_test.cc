// Each defect of the camera does what sim/camera_sensor.h and sim/pixel_noise.h say, and nothing else.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <memory>
#include <set>
#include <utility>
#include <vector>

#include <boost/math/distributions/students_t.hpp>
#include <gtest/gtest.h>

#include "core/time.h"
#include "sim/camera_sensor.h"
#include "sim/frame_view.h"
#include "sim/pixel_noise.h"
#include "sim/simulate.h"
#include "sim/world.h"

namespace plumbline::sim {
namespace {

constexpr core::TrialId kId{.seed = 1, .trial = 0};

// |score| < 4.5 fails by chance in 7e-6 of cases.
constexpr double kLargestScore = 4.5;
double binomial_score(double hits, double n, double p) { return std::abs(hits - n * p) / std::sqrt(n * p * (1.0 - p)); }

ScenarioConfig some_config() {
  ScenarioConfig config;
  config.duration_s = 6.0;
  config.trajectory.handheld = {.speed_rms_m_s = 0.7, .rate_rms_rad_s = 0.75};
  config.imu.noise = {1.7e-4, 2e-5, 2e-3, 3e-3};
  config.camera.td_s = 0.02;
  config.camera.readout_s = 0.03;
  config.world.landmarks = 1000;
  config.points.loss_probability = 0.02;
  config.points.velocity_source = VelocitySource::kNone;
  return config;
}

std::vector<core::Frame> frames_of(const ScenarioConfig& config) { return simulate(config, kId).measurements.frames; }

bool same_points(const core::Frame& a, const core::Frame& b) {
  if (a.points.size() != b.points.size()) return false;
  for (std::size_t i = 0; i < a.points.size(); ++i) {
    if (a.points[i].track_id != b.points[i].track_id || a.points[i].pixel != b.points[i].pixel) return false;
  }
  return true;
}

// The observations of two recordings with the same frames and tracks.
template <class F>
void for_each_pair(const std::vector<core::Frame>& a, const std::vector<core::Frame>& b, const F& f) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    ASSERT_EQ(a[i].points.size(), b[i].points.size());
    for (std::size_t j = 0; j < a[i].points.size(); ++j) {
      ASSERT_EQ(a[i].points[j].track_id, b[i].points[j].track_id);
      f(a[i].points[j].pixel, b[i].points[j].pixel);
    }
  }
}

// A row shows the middle of its exposure: t_imu = t_stamp + td_s + exposure/2 where the stamp is of the start.
TEST(CameraDefects, ExposureShiftsTdWhereStampsAreOfItsStart) {
  ScenarioConfig config = some_config();
  const core::RigCalibration without = config.calibration();
  const auto reference = frames_of(config);
  config.camera.exposure_s = 0.01;
  EXPECT_EQ(config.calibration().td_s, without.td_s);
  const auto middle = frames_of(config);
  for_each_pair(reference, middle, [](const auto& a, const auto& b) { EXPECT_EQ(a, b); });

  config.camera.exposure_stamp = ExposureStamp::kStart;
  EXPECT_EQ(config.calibration().td_s, without.td_s + 0.005);
  config.camera.td_s -= 0.005;  // the same rig again, told otherwise
  const auto start = frames_of(config);
  for_each_pair(reference, start, [](const auto& a, const auto& b) { EXPECT_LT((a - b).norm(), 1e-9); });
}

// td, readout and exposure decide which frames a recording can hold, not what is drawn for them: a rig at rest sees the
// same noise at the same stamps.
TEST(CameraDefects, TimingChangesNoDraw) {
  ScenarioConfig config = some_config();
  config.trajectory.type = TrajectoryType::kStatic;
  config.camera.td_s = -0.001;
  config.camera.readout_s = 0.0;
  config.camera.uniform_outlier_probability = 0.1;
  config.points.loss_probability = 0.0;
  const auto reference = frames_of(config);
  const auto expect_same_draws = [&](const std::vector<core::Frame>& frames) {
    std::size_t common = 0;
    for (const core::Frame& frame : frames) {
      const auto other = std::find_if(reference.begin(), reference.end(),
                                      [&](const core::Frame& f) { return f.t_cam_ns == frame.t_cam_ns; });
      if (other == reference.end()) continue;
      ++common;
      EXPECT_TRUE(same_points(frame, *other)) << frame.t_cam_ns;
    }
    EXPECT_GT(common, 50U);
    return frames.front().t_cam_ns != reference.front().t_cam_ns;
  };
  bool first_frame_moved = false;
  config.camera.exposure_s = 0.008;
  config.camera.exposure_stamp = ExposureStamp::kStart;
  first_frame_moved |= expect_same_draws(frames_of(config));
  config.camera.td_s = 0.02;
  first_frame_moved |= expect_same_draws(frames_of(config));
  config.camera.readout_s = 0.03;
  first_frame_moved |= expect_same_draws(frames_of(config));
  EXPECT_TRUE(first_frame_moved);
}

TEST(CameraDefects, DroppedFramesAreMissingAndChangeNoOther) {
  ScenarioConfig config = some_config();
  config.camera.pixel_noise_correlation = 0.8;
  const auto all = frames_of(config);
  config.camera.drop_probability = 0.2;
  const auto some = frames_of(config);
  auto kept = some.begin();
  for (const core::Frame& frame : all) {
    if (kept == some.end() || kept->t_cam_ns != frame.t_cam_ns) continue;
    EXPECT_TRUE(same_points(*kept, frame));
    ++kept;
  }
  EXPECT_EQ(kept, some.end());
  EXPECT_LT(binomial_score(static_cast<double>(all.size() - some.size()), static_cast<double>(all.size()), 0.2),
            kLargestScore);
}

TEST(CameraDefects, StampJitterMovesOnlyTheStamps) {
  ScenarioConfig config = some_config();
  config.duration_s = 30.0;
  const auto reference = frames_of(config);
  config.camera.stamp_jitter_s = 0.003;
  const auto jittered = frames_of(config);
  for_each_pair(reference, jittered, [](const auto& a, const auto& b) { EXPECT_EQ(a, b); });
  double sum = 0.0;
  double sum2 = 0.0;
  for (std::size_t i = 0; i < reference.size(); ++i) {
    const double x = core::to_seconds(jittered[i].t_cam_ns - reference[i].t_cam_ns) / 0.003;
    sum += x;
    sum2 += x * x;
    if (i > 0) {
      EXPECT_GT(jittered[i].t_cam_ns, jittered[i - 1].t_cam_ns);
    }
  }
  const auto n = static_cast<double>(reference.size());
  EXPECT_LT(std::abs(sum) / std::sqrt(n), kLargestScore);
  EXPECT_LT(std::abs(sum2 - n) / std::sqrt(2.0 * n), kLargestScore);
}

// The camera is triggered at another time, and says so.
TEST(CameraDefects, TriggerJitterMovesFrameAndStamp) {
  ScenarioConfig config = some_config();
  config.camera.pixel_sigma_px = 0.0;
  config.camera.trigger_jitter_s = 0.003;
  const auto trajectory = make_trajectory(config.trajectory, config.duration_s, kId);
  const World world = make_world(config, *trajectory, kId);
  const CameraRecording recording = simulate_camera(*trajectory, world, config, kCameraLeadS, kId);
  const core::RigCalibration calibration = config.calibration();
  double irregular = 0.0;
  for (const core::Frame& frame : recording.frames) {
    const double t_s = core::to_seconds(frame.t_cam_ns);
    irregular = std::max(irregular, std::abs(t_s - std::round(t_s * 20.0) / 20.0));
    const FrameView view(*trajectory, config.camera.model, calibration, 1.0, t_s);
    for (const core::PointObservation& point : frame.points) {
      const auto landmark = static_cast<std::size_t>(recording.track_landmark.at(point.track_id));
      EXPECT_EQ(point.pixel, view.expose(world.points_W[landmark])->pixel);
    }
  }
  EXPECT_GT(irregular, 0.003);
}

TEST(CameraDefects, JitterThatCouldSwapFramesIsRefused) {
  CameraConfig config;
  config.trigger_jitter_s = 0.003;
  config.stamp_jitter_s = 0.002;
  EXPECT_FALSE(validate(config).has_value());
  config.stamp_jitter_s = 0.0021;
  EXPECT_EQ(validate(config).value().key, "trigger_jitter_s");
}

TEST(CameraDefects, GrossOutliersAreOffsetAndChangeNoOther) {
  ScenarioConfig config = some_config();
  const auto clean = frames_of(config);
  config.camera.gross_outlier_probability = 0.1;
  config.camera.gross_outlier_sigma_px = 30.0;
  const auto spoilt = frames_of(config);
  double n = 0.0;
  double hits = 0.0;
  double sum2 = 0.0;
  for_each_pair(clean, spoilt, [&](const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
    n += 1.0;
    if (a == b) return;
    hits += 1.0;
    sum2 += ((b - a) / 30.0).squaredNorm();
  });
  EXPECT_LT(binomial_score(hits, n, 0.1), kLargestScore);
  EXPECT_LT(std::abs(sum2 - 2.0 * hits) / std::sqrt(4.0 * hits), kLargestScore);  // chi-square of 2 a hit
}

TEST(CameraDefects, UniformOutliersAreAnywhereAndChangeNoOther) {
  ScenarioConfig config = some_config();
  config.camera.gross_outlier_probability = 0.1;
  const auto clean = frames_of(config);
  config.camera.uniform_outlier_probability = 0.1;
  const auto spoilt = frames_of(config);
  double n = 0.0;
  double hits = 0.0;
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  Eigen::Vector2d sum2 = Eigen::Vector2d::Zero();
  for_each_pair(clean, spoilt, [&](const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
    n += 1.0;
    if (a == b) return;
    hits += 1.0;
    EXPECT_TRUE(config.camera.model.contains(b));
    // Uniform in (-1, 1): variance 1/3, and the square has the variance 1/5 - 1/9.
    const Eigen::Vector2d x(2.0 * (b.x() + 0.5) / 640.0 - 1.0, 2.0 * (b.y() + 0.5) / 480.0 - 1.0);
    sum += x;
    sum2 += x.cwiseAbs2();
  });
  EXPECT_LT(binomial_score(hits, n, 0.1), kLargestScore);
  EXPECT_LT(sum.cwiseAbs().maxCoeff() / std::sqrt(hits / 3.0), kLargestScore);
  const Eigen::Vector2d excess = sum2 - Eigen::Vector2d::Constant(hits / 3.0);
  EXPECT_LT(excess.cwiseAbs().maxCoeff() / std::sqrt(hits * (1.0 / 5.0 - 1.0 / 9.0)), kLargestScore);
}

TEST(CameraDefects, HeavyTailsAreStudents) {
  CameraConfig config;
  config.pixel_sigma_px = 2.0;
  config.pixel_noise_dof = 5.0;
  const PixelNoise noise(config, kId);
  const boost::math::students_t t(5.0);
  constexpr int kDraws = 50000;
  const double to_t = std::sqrt(5.0 / 3.0) / 2.0;  // a t of nu degrees has the variance nu/(nu - 2)
  for (const double p : {0.5, 0.1, 0.01, 0.001}) {
    const double bound = quantile(complement(t, 0.5 * p));
    Eigen::Vector2d beyond = Eigen::Vector2d::Zero();
    for (std::uint64_t i = 0; i < kDraws; ++i) {
      const Eigen::Vector2d x = to_t * noise.next_error(std::nullopt, i, 7);
      for (int c = 0; c < 2; ++c) beyond[c] += std::abs(x[c]) > bound ? 1.0 : 0.0;
    }
    EXPECT_LT(binomial_score(beyond.x(), kDraws, p), kLargestScore) << p;
    EXPECT_LT(binomial_score(beyond.y(), kDraws, p), kLargestScore) << p;
  }
}

// The same draws; t's radius differs from the normal's by a share of order ln(u)/nu.
TEST(CameraDefects, ManyDegreesOfFreedomAreNormal) {
  CameraConfig config;
  const PixelNoise normal(config, kId);
  CameraConfig heavy = config;
  heavy.pixel_noise_dof = 1e8;
  const PixelNoise student(heavy, kId);
  for (std::uint64_t i = 0; i < 1000; ++i) {
    EXPECT_LT((normal.next_error(std::nullopt, i, 3) - student.next_error(std::nullopt, i, 3)).norm(), 1e-5);
  }
}

// The errors of a long track: correlations 1, rho, rho^2 at lags 0, 1, 2. The estimate of a lag's covariance from n
// samples has a variance below (1 + rho^2)/(1 - rho^2) (1 + rho^2 lag) / n; 2 coordinates.
TEST(CameraDefects, CorrelatedNoiseIsAutoregressiveAndStationary) {
  CameraConfig config;
  config.pixel_sigma_px = 3.0;
  config.pixel_noise_correlation = 0.7;
  const PixelNoise noise(config, kId);
  constexpr int kFrames = 100000;
  std::vector<Eigen::Vector2d> errors;
  std::optional<Eigen::Vector2d> error;
  for (std::uint64_t i = 0; i < kFrames; ++i) {
    error = noise.next_error(error, i, 7);
    errors.push_back(*error / 3.0);
  }
  const double score_sigma = std::sqrt(2.0 * (1.49 / 0.51) / (2.0 * kFrames));
  for (const int lag : {0, 1, 2}) {
    double covariance = 0.0;
    for (std::size_t i = 2; i < errors.size(); ++i) {
      covariance += errors[i].dot(errors[i - static_cast<std::size_t>(lag)]) / (2.0 * (kFrames - 2));
    }
    EXPECT_LT(std::abs(covariance - std::pow(0.7, lag)), kLargestScore * score_sigma) << lag;
  }
  // A track's first error has the full variance, and another landmark shares nothing.
  double first2 = 0.0;
  double product = 0.0;
  constexpr int kTracks = 10000;
  for (std::uint64_t i = 0; i < kTracks; ++i) {
    const Eigen::Vector2d a = noise.next_error(std::nullopt, 5, i) / 3.0;
    first2 += a.squaredNorm();
    product += a.dot(noise.next_error(std::nullopt, 5, i + kTracks)) / 3.0;
  }
  EXPECT_LT(std::abs(first2 - 2.0 * kTracks) / std::sqrt(4.0 * kTracks), kLargestScore);
  EXPECT_LT(std::abs(product) / std::sqrt(2.0 * kTracks), kLargestScore);
}

// In the recording: the correlation is along a track, and a track that begins anew shares nothing with the old one.
TEST(CameraDefects, NoiseIsCorrelatedAlongATrack) {
  ScenarioConfig config = some_config();
  config.points.loss_probability = 0.3;
  config.points.per_frame = 100000;  // so that a lost landmark starts again at once
  config.camera.pixel_noise_correlation = 0.9;
  ScenarioConfig ideal = config;
  ideal.camera.pixel_sigma_px = 0.0;
  const Simulation noisy = simulate(config, kId);
  const Simulation clean = simulate(ideal, kId);
  struct Last {
    std::int64_t track;
    Eigen::Vector2d error;
  };
  std::map<int, Last> before;
  double same = 0.0;
  double n_same = 0.0;
  double anew = 0.0;
  double n_anew = 0.0;
  for (std::size_t i = 0; i < clean.measurements.frames.size(); ++i) {
    std::map<int, Last> now;
    for (std::size_t j = 0; j < clean.measurements.frames[i].points.size(); ++j) {
      const core::PointObservation& point = noisy.measurements.frames[i].points[j];
      const Eigen::Vector2d e = point.pixel - clean.measurements.frames[i].points[j].pixel;
      const int landmark = noisy.truth.track_landmark.at(point.track_id);
      now[landmark] = {point.track_id, e};
      const auto last = before.find(landmark);
      if (last == before.end()) continue;
      const bool continued = last->second.track == point.track_id;
      (continued ? same : anew) += e.dot(last->second.error);
      (continued ? n_same : n_anew) += 2.0;
    }
    before = std::move(now);
  }
  ASSERT_GT(n_anew, 1000.0);
  EXPECT_NEAR(same / n_same, 0.9, kLargestScore * std::sqrt(2.0 * (1.81 / 0.19) / n_same));
  EXPECT_LT(std::abs(anew) / std::sqrt(n_anew), kLargestScore);
}

// The landmarks that a frame holds are those that no wall hides from where the camera is at their own rows.
TEST(CameraDefects, WallsHideWhatIsBehindThem) {
  ScenarioConfig config = some_config();
  config.camera.pixel_sigma_px = 0.0;
  config.points.per_frame = 100000;
  const auto trajectory = make_trajectory(config.trajectory, config.duration_s, kId);
  World world = make_world(config, *trajectory, kId);
  const CameraRecording open = simulate_camera(*trajectory, world, config, kCameraLeadS, kId);
  // A screen before the camera's first place, across half of its view.
  const core::Pose T_W_C = trajectory->pose_at(1.0) * config.calibration().T_B_C;
  Wall& wall = world.walls.walls.emplace_back();
  wall.corner_W = T_W_C * Eigen::Vector3d(0.0, -3.0, 2.0);
  wall.u_W = T_W_C.q * Eigen::Vector3d(1.0, 0.0, 0.0);
  wall.v_W = T_W_C.q * Eigen::Vector3d(0.0, 1.0, 0.0);
  wall.size_m = {3.0, 6.0};
  world.walls_hide = true;
  const CameraRecording hidden = simulate_camera(*trajectory, world, config, kCameraLeadS, kId);

  int taken = 0;
  ASSERT_EQ(hidden.frames.size(), open.frames.size());
  for (std::size_t i = 0; i < open.frames.size(); ++i) {
    const FrameView view(*trajectory, config.camera.model, config.calibration(), 1.0,
                         core::to_seconds(open.frames[i].t_cam_ns));
    std::set<int> expected;
    for (const core::PointObservation& point : open.frames[i].points) {
      const int landmark = open.track_landmark.at(point.track_id);
      const Eigen::Vector3d& P_W = world.points_W[static_cast<std::size_t>(landmark)];
      if (occludes(wall, view.expose(P_W)->camera_W, P_W)) {
        ++taken;
      } else {
        expected.insert(landmark);
      }
    }
    std::set<int> seen;
    for (const core::PointObservation& point : hidden.frames[i].points) {
      seen.insert(hidden.track_landmark.at(point.track_id));
    }
    EXPECT_EQ(seen, expected);
  }
  EXPECT_GT(taken, 100);
}

// The row solve with lenses, against bisection of t = t_cam + td + (h_v(t) - rows/2) readout/rows.
TEST(CameraDefects, RowTimeIsExactBehindALens) {
  for (const core::Distortion& lens :
       {core::Distortion(core::DistortionModel::kRadtan, {-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05}),
        core::Distortion(core::DistortionModel::kEquidistant, {0.0035, 0.0007, -0.002, 0.0002})}) {
    ScenarioConfig config = some_config();
    config.camera.pixel_sigma_px = 0.0;
    config.camera.model.distortion = lens;
    if (lens.model() == core::DistortionModel::kEquidistant) {
      config.camera.model.fx_px = 190.0;
      config.camera.model.fy_px = 190.0;
    }
    const auto trajectory = make_trajectory(config.trajectory, config.duration_s, kId);
    const World world = make_world(config, *trajectory, kId);
    const CameraRecording recording = simulate_camera(*trajectory, world, config, kCameraLeadS, kId);
    const core::RigCalibration calibration = config.calibration();
    int n = 0;
    for (const core::Frame& frame : recording.frames) {
      const double t_middle_s = core::to_seconds(frame.t_cam_ns) + calibration.td_s;
      for (const core::PointObservation& point : frame.points) {
        const auto landmark = static_cast<std::size_t>(recording.track_landmark.at(point.track_id));
        const auto pixel_at = [&](double t_s) -> Eigen::Vector2d {
          const core::Pose T_W_C = trajectory->pose_at(t_s) * calibration.T_B_C;
          return config.camera.model.project(T_W_C.inverse() * world.points_W[landmark]).value();
        };
        const auto row_time = [&](double v) {
          return t_middle_s + core::row_phase(v, config.camera.model.height_px) * calibration.readout_s;
        };
        const double t_s = row_time(point.pixel.y());
        double before = t_s - 1e-4;
        double after = t_s + 1e-4;
        while (after - before > 1e-11) {
          const double t = 0.5 * (before + after);
          (t < row_time(pixel_at(t).y()) ? before : after) = t;
        }
        ASSERT_LT(std::abs(t_s - before), 1e-10);
        ASSERT_LT((point.pixel - pixel_at(before)).norm(), 1e-6);
        ++n;
      }
    }
    EXPECT_GT(n, 1000);
  }
}

// No camera defect reaches the IMU or the prior, and no IMU defect the camera.
TEST(CameraDefects, SensorsDoNotShareDefects) {
  const Simulation reference = simulate(some_config(), kId);
  ScenarioConfig camera = some_config();
  camera.camera.drop_probability = 0.1;
  camera.camera.stamp_jitter_s = 1e-3;
  camera.camera.trigger_jitter_s = 1e-3;
  camera.camera.gross_outlier_probability = 0.1;
  camera.camera.uniform_outlier_probability = 0.1;
  camera.camera.pixel_noise_dof = 4.0;
  camera.camera.pixel_noise_correlation = 0.5;
  const Simulation a = simulate(camera, kId);
  ASSERT_EQ(a.measurements.imu.size(), reference.measurements.imu.size());
  for (std::size_t i = 0; i < a.measurements.imu.size(); ++i) {
    ASSERT_EQ(a.measurements.imu[i].gyro_rad_s, reference.measurements.imu[i].gyro_rad_s);
    ASSERT_EQ(a.measurements.imu[i].accel_m_s2, reference.measurements.imu[i].accel_m_s2);
  }
  EXPECT_EQ(a.measurements.prior.calibration.td_s, reference.measurements.prior.calibration.td_s);
  EXPECT_EQ(a.measurements.prior.mean.v_W, reference.measurements.prior.mean.v_W);

  ScenarioConfig imu = some_config();
  imu.imu.dropout_probability = 0.1;
  imu.imu.stamp_jitter_s = 1e-4;
  imu.imu.gyro.saturation = 0.5;
  imu.imu.accel.noise_factor.setConstant(2.0);
  const Simulation b = simulate(imu, kId);
  ASSERT_EQ(b.measurements.frames.size(), reference.measurements.frames.size());
  for (std::size_t i = 0; i < b.measurements.frames.size(); ++i) {
    EXPECT_EQ(b.measurements.frames[i].t_cam_ns, reference.measurements.frames[i].t_cam_ns);
    EXPECT_TRUE(same_points(b.measurements.frames[i], reference.measurements.frames[i]));
  }
  EXPECT_EQ(b.measurements.prior.calibration.td_s, reference.measurements.prior.calibration.td_s);
  EXPECT_EQ(b.measurements.prior.mean.v_W, reference.measurements.prior.mean.v_W);
}

}  // namespace
}  // namespace plumbline::sim
