// A rolling-shutter frame that sees a line segment: what the line factors are tested on. Everything is exact (closed
// forms of the simulator) unless noise is asked for.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <optional>
#include <stdexcept>
#include <vector>

#include <Eigen/Core>

#include "core/measurements.h"
#include "core/random.h"
#include "core/time.h"
#include "estimator/factors/line_factors.h"
#include "sim/frame_view.h"
#include "sim/trajectory.h"
#include "simulated_rig.h"

namespace plumbline::testing {

inline constexpr double kLineSigmaPx = 0.5;

struct LineView {
  core::PinholeCamera camera;
  core::RigCalibration rig;
  core::State state;
  std::shared_ptr<const std::vector<core::ImuSample>> samples;
  std::size_t state_index = 0;
  double offset_s = 0.0;  // t_cam - s_k
  double td_k_s = 0.0;    // with which the state's instant was formed
  Eigen::Vector3d origin_W = Eigen::Vector3d::Zero();
  estimator::LineBlock line = estimator::LineBlock::Zero();
  estimator::SegmentPixels pixels;
  estimator::SegmentVelocities velocities;
};

inline estimator::CameraModel line_model(const LineView& v) { return {v.camera, kLineSigmaPx, kGravity}; }

// The line through two points of the world, about its origin.
inline std::optional<estimator::LineBlock> line_block(const Eigen::Vector3d& C, const Eigen::Vector3d& D,
                                                      const Eigen::Vector3d& origin_W) {
  return estimator::orthonormal_line(estimator::line_through(C - origin_W, D - origin_W));
}

// Frame stamped t_cam, state at the IMU sample nearest to t_cam + td + state_lag. The segment lies 2 to 5 m ahead.
inline LineView line_view(const sim::Trajectory& trajectory, const core::RigCalibration& rig,
                          const core::PinholeCamera& camera, std::uint64_t index, double state_lag_s) {
  constexpr double kRateHz = 1000.0;
  const core::RandomStream random({19, index}, "line_scene");
  const core::ImuBias bias{0.02 * random.normal3(0), 0.1 * random.normal3(1)};
  LineView s;
  s.camera = camera;
  s.rig = rig;
  s.samples = exact_samples(trajectory, kRateHz, bias);
  // On a sample, so that td_k is td where there is no lag.
  const double s_middle = 0.5 + 0.001 * static_cast<double>(index % 7);
  const double t_cam_s = s_middle - rig.td_s;
  s.state_index = static_cast<std::size_t>(std::llround((s_middle + state_lag_s) * kRateHz));
  const double s_k = core::to_seconds((*s.samples)[s.state_index].t_ns);
  s.offset_s = t_cam_s - s_k;
  s.td_k_s = -s.offset_s;
  s.state = state_at(trajectory, s_k, bias);

  const core::Pose T_W_C = s.state.T_W_B * rig.T_B_C;
  const sim::FrameView frame(trajectory, s.camera, s.rig, sim::half_angle_of_view_rad(s.camera), t_cam_s);
  for (std::uint64_t k = 0; k < 1000; ++k) {
    std::array<Eigen::Vector3d, 2> ends;
    bool seen = true;
    for (std::uint64_t e = 0; e < 2; ++e) {
      const Eigen::Vector2d pixel(640.0 * random.uniform(2 + e, k), 480.0 * random.uniform(4 + e, k));
      ends[e] = T_W_C * ((2.0 + 3.0 * random.uniform(6 + e, k)) * s.camera.unproject(pixel));
      const auto exposure = frame.expose(ends[e]);
      seen = seen && exposure && s.camera.contains(exposure->pixel);
      if (!seen) break;
      s.pixels[e] = exposure->pixel;
      s.velocities[e] = frame.image_velocity(ends[e], exposure->t_imu_s);
    }
    if (!seen || (s.pixels[0] - s.pixels[1]).norm() < 100.0) continue;
    // Where the first camera that saw it was thought to be.
    s.origin_W = T_W_C.p + 0.1 * random.normal3(8);
    s.line = line_block(ends[0], ends[1], s.origin_W).value();
    return s;
  }
  throw std::logic_error("line_view: no segment is seen");
}

// Lively motion; the state up to 8 ms off the middle row.
inline LineView handheld_line(std::uint64_t index, double readout_s = 0.03, double largest_lag_s = 0.008,
                              core::DistortionModel lens = core::DistortionModel::kNone) {
  sim::TrajectoryConfig config;
  const auto trajectory = sim::make_trajectory(config, 2.0, {23, index});
  const double lag_s = largest_lag_s * (static_cast<double>(index % 5) - 2.0) / 2.0;
  return line_view(*trajectory, scene_rig(readout_s), scene_camera(lens), index, lag_s);
}

inline core::Pose scene_start(std::uint64_t index) {
  const core::RandomStream random({29, index}, "line_scene");
  return {core::exp_quaternion(random.normal3(0)), random.normal3(1)};
}

inline LineView sliding_line(std::uint64_t index, core::DistortionModel lens = core::DistortionModel::kNone) {
  const core::RigCalibration rig = scene_rig(0.03);
  const SlidingMotion motion(rig.T_B_C, scene_start(index), {0.5, -0.3});
  return line_view(motion, rig, scene_camera(lens), index, 0.0);
}

inline LineView still_line(std::uint64_t index, core::DistortionModel lens = core::DistortionModel::kNone) {
  const core::RigCalibration rig = scene_rig(0.0, 0.0);
  const SlidingMotion motion(rig.T_B_C, scene_start(index), {0.0, 0.0});
  return line_view(motion, rig, scene_camera(lens), index, 0.0);
}

}  // namespace plumbline::testing
