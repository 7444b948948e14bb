// What a frame shows of a segment, against plain projection and a dense scan.
#include "sim/segment_sight.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace plumbline::sim {
namespace {

constexpr core::TrialId kId{.seed = 2, .trial = 0};

struct Scene {
  ScenarioConfig config;
  std::unique_ptr<const Trajectory> trajectory;
  World world;
  core::RigCalibration calibration;

  explicit Scene(const ScenarioConfig& c)
      : config(c),
        trajectory(make_trajectory(c.trajectory, c.duration_s, kId)),
        world(make_world(c, *trajectory, kId)),
        calibration(c.calibration()) {}

  FrameView view(double t_cam_s) const {
    const core::PinholeCamera& camera = config.camera.model;
    return {*trajectory, camera, calibration, half_angle_of_view_rad(camera), t_cam_s};
  }
  SegmentSight sight() const { return {world, config.camera.model, config.lines.nearest_m, config.lines.farthest_m}; }
  Eigen::Vector2d project(const Eigen::Vector3d& P_W, double t_imu_s) const {
    const auto pixel = config.camera.model.project((trajectory->pose_at(t_imu_s) * calibration.T_B_C).inverse() * P_W);
    return pixel.value_or(Eigen::Vector2d::Constant(std::nan("")));
  }
};

ScenarioConfig fast_rooms() {
  ScenarioConfig config;
  config.duration_s = 12.0;
  config.trajectory.type = TrajectoryType::kFigureEight;
  config.trajectory.loop.radius_m = 5.0;
  config.trajectory.loop.period_s = 12.0;
  config.camera.td_s = 0.02;
  config.camera.readout_s = 0.03;
  config.world.type = WorldType::kRooms;
  config.world.landmarks = 10;
  config.world.lines.random = 150;
  config.lines.per_frame = 100000;
  config.lines.farthest_m = 6.0;
  return config;
}

ScenarioConfig fast_shell() {
  ScenarioConfig config;
  config.duration_s = 4.0;
  config.trajectory.handheld = {.speed_rms_m_s = 0.7, .rate_rms_rad_s = 0.75};
  config.camera.td_s = 0.02;
  config.camera.readout_s = 0.03;
  config.camera.model.distortion = {core::DistortionModel::kRadtan, {-0.283, 0.074, 2e-4, 2e-5}};
  config.world.landmarks = 10;
  config.world.lines.random = 300;
  config.world.lines.random_longest_m = 4.0;
  config.lines.per_frame = 100000;
  config.lines.farthest_m = 6.0;
  return config;
}

struct Border {
  double picture_px;  // how far the end is from the nearest border of the picture
  double depth_m;     // likewise of the range of depth
};

Border border_of(const Scene& scene, const Exposure& e) {
  const auto& camera = scene.config.camera.model;
  return {std::min({std::abs(e.pixel.x() + 0.5), std::abs(camera.width_px - 0.5 - e.pixel.x()),
                    std::abs(e.pixel.y() + 0.5), std::abs(camera.height_px - 0.5 - e.pixel.y())}),
          std::min(std::abs(e.depth_m - scene.config.lines.nearest_m),
                   std::abs(e.depth_m - scene.config.lines.farthest_m))};
}

class Pieces : public testing::TestWithParam<bool> {
 protected:
  const Scene scene_{GetParam() ? fast_rooms() : fast_shell()};

  template <class F>
  void for_each_piece(const F& f) const {
    const SegmentSight sight = scene_.sight();
    for (double t = 0.5; t < scene_.config.duration_s - 0.5; t += 0.37) {
      const FrameView view = scene_.view(t);
      for (const Segment& segment : scene_.world.segments_W) f(view, segment, sight.longest_visible(view, segment), t);
    }
  }
};

// Each end is the segment's point at s, projected at the time of its row, and that time is its row's.
TEST_P(Pieces, EndsAreExposedWithTheirOwnRows) {
  const auto& camera = scene_.config.camera.model;
  const double readout_s = scene_.config.camera.readout_s;
  int n = 0;
  double apart_s = 0.0;
  for_each_piece([&](const FrameView&, const Segment& segment, const auto& piece, double t_cam_s) {
    if (!piece) return;
    for (const PieceEnd& end : piece->ends) {
      const Exposure& e = end.exposure;
      const double row_time_s = t_cam_s + 0.02 + (e.pixel.y() / camera.height_px - 0.5) * readout_s;
      EXPECT_NEAR(e.t_imu_s, row_time_s, 2e-12);  // the tolerance of the row solve
      EXPECT_LT((e.pixel - scene_.project(segment.at(end.s), e.t_imu_s)).norm(), 1e-9);
      ++n;
    }
    apart_s = std::max(apart_s, std::abs(piece->ends[0].exposure.t_imu_s - piece->ends[1].exposure.t_imu_s));
  });
  EXPECT_GT(n, 500);
  EXPECT_GT(apart_s, 0.5 * readout_s);
}

// Ends are borders: of the segment, of the picture, of the range of depth, or of what a wall hides.
TEST_P(Pieces, EndWhereTheSegmentOrTheSightEnds) {
  int own = 0;
  int picture = 0;
  int depth = 0;
  int wall = 0;
  const SegmentSight sight = scene_.sight();
  for_each_piece([&](const FrameView& view, const Segment& segment, const auto& piece, double) {
    if (!piece) return;
    ASSERT_LT(piece->ends[0].s, piece->ends[1].s);
    for (const int k : {0, 1}) {
      const PieceEnd& end = piece->ends[static_cast<std::size_t>(k)];
      const Border border = border_of(scene_, end.exposure);
      if (end.s == k) {
        ++own;
      } else if (border.picture_px < 1e-8) {
        ++picture;
      } else if (border.depth_m < 1e-8) {
        ++depth;
      } else {
        // 1e-9 of the length beyond it is hidden, and as much before it is not.
        ++wall;
        const double outwards = k == 0 ? -1e-9 : 1e-9;
        EXPECT_FALSE(sight.sees(view, segment.at(end.s + outwards)).has_value());
        EXPECT_TRUE(sight.sees(view, segment.at(end.s - outwards)).has_value());
      }
    }
  });
  EXPECT_GT(own, 100);
  EXPECT_GT(picture, 50);
  EXPECT_EQ(wall > 20, GetParam());
  EXPECT_EQ(wall == 0, !GetParam());
  EXPECT_GT(depth, 0);
}

// A dense scan: all of the piece is seen, and nowhere is a piece seen that is longer by more than two of its places.
TEST_P(Pieces, AreSeenThroughoutAndTheLongest) {
  constexpr int kScan = 200;
  const SegmentSight sight = scene_.sight();
  int segments = 0;
  int missed = 0;
  for_each_piece([&](const FrameView& view, const Segment& segment, const auto& piece, double) {
    if (++segments % 7 != 0) return;
    if (piece) {
      for (int i = 1; i < 40; ++i) {
        const double s = at_image_share(*piece, i / 40.0);
        const auto exposure = view.expose(segment.at(s));
        ASSERT_TRUE(exposure.has_value());
        // A curve may touch a border between the places that were asked, by a fraction of its sagitta.
        const auto& camera = scene_.config.camera.model;
        EXPECT_GT(exposure->pixel.x(), -0.6);
        EXPECT_LT(exposure->pixel.x(), camera.width_px - 0.4);
        EXPECT_GT(exposure->pixel.y(), -0.6);
        EXPECT_LT(exposure->pixel.y(), camera.height_px - 0.4);
      }
    }
    double longest_px = 0.0;
    std::optional<Exposure> first;
    for (int i = 0; i <= kScan; ++i) {
      const auto now = sight.sees(view, segment.at(static_cast<double>(i) / kScan));
      if (!now) {
        first.reset();
        continue;
      }
      if (!first) first = now;
      longest_px = std::max(longest_px, (now->pixel - first->pixel).norm());
    }
    const double found_px = piece ? piece->length_px() : 0.0;
    // A twelfth of the longest line that the picture and its margin hold at either end.
    if (found_px < longest_px - 2.0 * 1000.0 / 12.0) ++missed;
    if (!piece && longest_px > 100.0) ++missed;
  });
  EXPECT_GT(segments, 2000);
  EXPECT_EQ(missed, 0);
}

INSTANTIATE_TEST_SUITE_P(Worlds, Pieces, testing::Bool(),
                         [](const auto& rooms) { return std::string(rooms.param ? "rooms" : "shell_with_lens"); });

// At rest with a global shutter and no lens, the piece is the text-book one: the projection of a line clipped to the
// picture.
TEST(SegmentSight, AtRestIsTheTextBookProjection) {
  ScenarioConfig config = fast_shell();
  config.trajectory.type = TrajectoryType::kStatic;
  config.camera.readout_s = 0.0;
  config.camera.model.distortion = {};
  Scene scene(config);
  const core::Pose T_W_C = scene.trajectory->pose_at(0.0) * scene.calibration.T_B_C;
  const auto& camera = config.camera.model;
  // At depth 2, from far beyond the left border to 0.5 right of the axis, at 0.1 below it.
  scene.world.segments_W = {{{T_W_C * Eigen::Vector3d(-5.0, 0.1, 2.0), T_W_C * Eigen::Vector3d(0.5, 0.1, 2.0)}}};
  const auto piece = scene.sight().longest_visible(scene.view(1.0), scene.world.segments_W[0]);
  ASSERT_TRUE(piece.has_value());
  const double v = camera.fy_px * 0.05 + camera.cy_px;
  EXPECT_LT((piece->ends[0].exposure.pixel - Eigen::Vector2d(-0.5, v)).norm(), 1e-9);
  EXPECT_LT((piece->ends[1].exposure.pixel - Eigen::Vector2d(camera.fx_px * 0.25 + camera.cx_px, v)).norm(), 1e-9);
  EXPECT_EQ(piece->ends[1].s, 1.0);
  // -0.5 = fx x/2 + cx
  const double x = -2.0 * (camera.cx_px + 0.5) / camera.fx_px;
  EXPECT_NEAR(piece->ends[0].s, (x + 5.0) / 5.5, 1e-11);
}

TEST(SegmentSight, AWallCutsWhatIsBehindIt) {
  ScenarioConfig config = fast_shell();
  config.trajectory.type = TrajectoryType::kStatic;
  config.camera.model.distortion = {};
  Scene scene(config);
  const core::Pose T_W_C = scene.trajectory->pose_at(0.0) * scene.calibration.T_B_C;
  // A wall at depth 1 that covers x < 0.1: at depth 2 it hides x < 0.2.
  scene.world.walls_hide = true;
  scene.world.walls.walls = {{.corner_W = T_W_C * Eigen::Vector3d(-3.0, -3.0, 1.0),
                              .u_W = T_W_C.q * Eigen::Vector3d::UnitX(),
                              .v_W = T_W_C.q * Eigen::Vector3d::UnitY(),
                              .size_m = {3.1, 6.0},
                              .openings = {}}};
  const Segment segment{{T_W_C * Eigen::Vector3d(-0.6, 0.1, 2.0), T_W_C * Eigen::Vector3d(0.6, 0.1, 2.0)}};
  const auto piece = scene.sight().longest_visible(scene.view(1.0), segment);
  ASSERT_TRUE(piece.has_value());
  EXPECT_NEAR(piece->ends[0].s, 0.8 / 1.2, 1e-10);
  EXPECT_EQ(piece->ends[1].s, 1.0);
  // Through a window in it, x from 0 to 0.04 at depth 1, hardly anything more is seen: the longer piece is reported.
  scene.world.walls.walls[0].openings = {{Eigen::Vector2d(3.0, 0.0), Eigen::Vector2d(3.04, 6.0)}};
  EXPECT_NEAR(scene.sight().longest_visible(scene.view(1.0), segment)->ends[0].s, 0.8 / 1.2, 1e-10);
}

TEST(SegmentSight, BehindTheCameraIsNothing) {
  ScenarioConfig config = fast_shell();
  config.trajectory.type = TrajectoryType::kStatic;
  Scene scene(config);
  const core::Pose T_W_C = scene.trajectory->pose_at(0.0) * scene.calibration.T_B_C;
  const auto seen = [&](const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
    return scene.sight().longest_visible(scene.view(1.0), {{T_W_C * a, T_W_C * b}});
  };
  EXPECT_FALSE(seen({-1.0, 0.0, -2.0}, {1.0, 0.0, -2.0}));
  EXPECT_FALSE(seen({-1.0, 0.0, 0.1}, {1.0, 0.0, 0.1}));    // nearer than is tracked
  EXPECT_FALSE(seen({-1.0, 0.0, 20.0}, {1.0, 0.0, 20.0}));  // farther
  EXPECT_FALSE(seen({0.0, 0.0, -1.0}, {0.0, 0.0, -3.0}));   // along the axis, behind
  // From behind the camera to before it: cut at the nearest depth, or where it leaves the picture.
  const auto through = seen({0.1, 0.0, -2.0}, {0.1, 0.0, 5.0});
  ASSERT_TRUE(through.has_value());
  EXPECT_NEAR(through->ends[0].exposure.depth_m, config.lines.nearest_m, 1e-9);
  EXPECT_EQ(through->ends[1].s, 1.0);
}

}  // namespace
}  // namespace plumbline::sim
