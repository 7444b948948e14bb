// Image velocities of the ends of lines: the exact ones, and a tracker's across the line.
#include "sim/line_velocity.h"

#include <array>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "core/time.h"
#include "sim/simulate.h"
#include "sim/trajectory.h"

namespace plumbline::sim {
namespace {

constexpr core::TrialId kId{.seed = 1, .trial = 0};
using Chord = std::array<Eigen::Vector2d, 2>;

const core::PinholeCamera kCamera;  // without a lens

Eigen::Vector2d pixel(const Eigen::Vector2d& xy) {
  return {kCamera.fx_px * xy.x() + kCamera.cx_px, kCamera.fy_px * xy.y() + kCamera.cy_px};
}

core::Frame frame_of(core::TimeNs t_ns, const Chord& normalised) {
  return {.t_cam_ns = t_ns,
          .lines = {{.track_id = 7, .ends_px = {pixel(normalised[0]), pixel(normalised[1])}, .velocities = {}}}};
}

// A vertical line that moves to the right by 0.01 in 50 ms, its ends sliding along it meanwhile.
TEST(LineVelocity, IsTheWayAcrossTheLineWhateverTheEndsDo) {
  std::vector<core::Frame> frames = {frame_of(0, {Eigen::Vector2d(0.1, -0.2), {0.1, 0.3}}),
                                     frame_of(50'000'000, {Eigen::Vector2d(0.11, -0.35), {0.11, 0.1}})};
  add_finite_difference_line_velocities(frames, kCamera, 0.0);
  for (const core::Frame& frame : frames) {
    ASSERT_TRUE(frame.lines[0].velocities.has_value());
    for (const Eigen::Vector2d& v : *frame.lines[0].velocities) {
      EXPECT_LT((v - Eigen::Vector2d(0.2, 0.0)).norm(), 1e-12);
    }
  }
}

// Down by 0.05 in 50 ms of which the readout takes its part: rows move by 0.05 * 460 = 23 of 480, read in 30 ms.
TEST(LineVelocity, TakesTheTimeBetweenTheRows) {
  std::vector<core::Frame> frames = {frame_of(0, {Eigen::Vector2d(-0.2, 0.1), {0.3, 0.1}}),
                                     frame_of(50'000'000, {Eigen::Vector2d(-0.2, 0.15), {0.3, 0.15}})};
  add_finite_difference_line_velocities(frames, kCamera, 0.03);
  const double dt_s = 0.05 + 23.0 / 480.0 * 0.03;
  for (const core::Frame& frame : frames) {
    for (const Eigen::Vector2d& v : *frame.lines[0].velocities) {
      EXPECT_LT((v - Eigen::Vector2d(0.0, 0.05 / dt_s)).norm(), 1e-12);
    }
  }
}

TEST(LineVelocity, IsAbsentWhereNothingIsKnown) {
  // A track of one frame, one with a gap, and a chord without length.
  std::vector<core::Frame> frames(3);
  frames[0] = frame_of(0, {Eigen::Vector2d(0.0, 0.0), {0.1, 0.0}});
  frames[1].t_cam_ns = 50'000'000;
  frames[2] = frame_of(100'000'000, {Eigen::Vector2d(0.0, 0.1), {0.1, 0.1}});
  add_finite_difference_line_velocities(frames, kCamera, 0.0);
  EXPECT_FALSE(frames[0].lines[0].velocities.has_value());
  EXPECT_FALSE(frames[2].lines[0].velocities.has_value());
  frames[1] = frame_of(50'000'000, {Eigen::Vector2d(0.1, 0.1), {0.1, 0.1}});
  add_finite_difference_line_velocities(frames, kCamera, 0.0);
  EXPECT_FALSE(frames[0].lines[0].velocities.has_value());
}

ScenarioConfig moving(VelocitySource source) {
  ScenarioConfig config;
  config.duration_s = 4.0;
  config.trajectory.handheld = {.speed_rms_m_s = 0.7, .rate_rms_rad_s = 0.75};
  config.camera.readout_s = 0.03;
  config.camera.rate_hz = 100.0;
  config.world.landmarks = 10;
  config.world.lines.random = 300;
  config.points.per_frame = 0;
  config.lines.per_frame = 30;
  config.lines.sigma_px = 0.0;
  config.lines.velocity_source = source;
  config.prior.readout_sigma_s = 0.0;  // the tracker knows the readout
  return config;
}

// The exact velocity is that of the end's own point of the line: by central differences of its projection.
TEST(LineVelocity, ExactIsThatOfThePointInSpace) {
  const ScenarioConfig config = moving(VelocitySource::kExact);
  const Simulation s = simulate(config, kId);
  const auto trajectory = make_trajectory(config.trajectory, config.duration_s, kId);
  const core::Pose T_B_C = config.calibration().T_B_C;
  auto ends = s.truth.line_ends.begin();
  int n = 0;
  for (const core::Frame& frame : s.measurements.frames) {
    for (const core::LineObservation& line : frame.lines) {
      const Segment& segment = s.truth.segments_W[static_cast<std::size_t>(ends->segment)];
      for (const std::size_t k : {std::size_t{0}, std::size_t{1}}) {
        // The point of the segment nearest to the ray of the pixel.
        const double t = ends->t_imu_s[k];
        const core::Pose T_W_C = trajectory->pose_at(t) * T_B_C;
        const Eigen::Vector3d ray = T_W_C.q * config.camera.model.unproject(ends->ends_px[k]);
        const Eigen::Vector3d d = segment.ends_W[1] - segment.ends_W[0];
        const Eigen::Vector3d across = ray.cross(d).cross(ray);
        const Eigen::Vector3d P = segment.at(-across.dot(segment.ends_W[0] - T_W_C.p) / across.dot(d));
        const auto at = [&](double time) -> Eigen::Vector2d {
          return ((trajectory->pose_at(time) * T_B_C).inverse() * P).hnormalized();
        };
        constexpr double h = 1e-4;
        const Eigen::Vector2d numeric = (at(t + h) - at(t - h)) / (2.0 * h);
        // The difference is of second order, 1e-8 times a third derivative of some 100; lines nearly along the ray
        // leave the point uncertain.
        if (across.norm() > 0.1 * d.norm()) {
          EXPECT_LT(((*line.velocities)[k] - numeric).norm(), 1e-5);
        }
        ++n;
      }
      ++ends;
    }
  }
  EXPECT_GT(n, 1000);
}

// Without noise the tracker's velocity is, across the line, the exact one to first order in the interval: 10 ms with
// accelerations of the picture of some 5 /s^2.
TEST(LineVelocity, FiniteDifferencesComeNearTheTruthAcrossTheLine) {
  const Simulation exact = simulate(moving(VelocitySource::kExact), kId);
  const Simulation tracked = simulate(moving(VelocitySource::kFiniteDifference), kId);
  double error2 = 0.0;
  double speed2 = 0.0;
  int n = 0;
  for (std::size_t i = 0; i < exact.measurements.frames.size(); ++i) {
    const auto& a = exact.measurements.frames[i].lines;
    const auto& b = tracked.measurements.frames[i].lines;
    ASSERT_EQ(a.size(), b.size());
    for (std::size_t j = 0; j < a.size(); ++j) {
      if (!b[j].velocities) continue;
      const Eigen::Vector2d along = b[j].ends_px[1] - b[j].ends_px[0];
      const Eigen::Vector2d normal = Eigen::Vector2d(-along.y(), along.x()).normalized();
      for (const std::size_t k : {std::size_t{0}, std::size_t{1}}) {
        const double truth = normal.dot((*a[j].velocities)[k]);
        error2 += std::pow(normal.dot((*b[j].velocities)[k]) - truth, 2);
        speed2 += truth * truth;
        ++n;
      }
    }
  }
  ASSERT_GT(n, 5000);
  EXPECT_LT(std::sqrt(error2 / n), 0.05);
  EXPECT_GT(std::sqrt(speed2 / n), 0.3);
}

}  // namespace
}  // namespace plumbline::sim
