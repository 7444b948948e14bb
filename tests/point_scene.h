// Two frames of a simulated rig that see one landmark: what the point factors are tested on. Everything is exact
// (closed forms of the simulator) unless noise is asked for.
#pragma once

#include <cmath>
#include <memory>
#include <optional>
#include <stdexcept>
#include <vector>

#include <Eigen/Core>

#include "core/measurements.h"
#include "core/random.h"
#include "core/time.h"
#include "sim/frame_view.h"
#include "sim/trajectory.h"
#include "simulated_rig.h"

namespace plumbline::testing {

struct SceneView {
  double t_cam_s = 0.0;
  std::size_t state_index = 0;  // the IMU sample of the frame's state
  double offset_s = 0.0;        // t_cam - s_k
  core::State state = {};
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
  Eigen::Vector2d velocity = Eigen::Vector2d::Zero();  // of the normalised coordinates
  Eigen::Vector3d bearing = Eigen::Vector3d::Zero();   // (x, y, 1) when the row is exposed
  double inverse_depth = 0.0;
  Eigen::Vector3d bearing_at_state = Eigen::Vector3d::Zero();
  double inverse_depth_at_state = 0.0;
};

struct TwoViews {
  core::PinholeCamera camera;
  core::RigCalibration rig;
  std::shared_ptr<const std::vector<core::ImuSample>> samples;
  SceneView anchor;
  SceneView observer;
};

// Scene `index` of a trajectory: a landmark 2 to 6 m ahead, frames 0.3 s apart, states at the samples (200 Hz or what
// rate_hz says) some milliseconds off the middle rows.
inline TwoViews two_views(const sim::Trajectory& trajectory, const core::RigCalibration& rig,
                          const core::PinholeCamera& camera, std::uint64_t index, double rate_hz) {
  const core::RandomStream random({17, index}, "point_scene");
  const core::ImuBias bias{0.02 * random.normal3(0), 0.1 * random.normal3(1)};
  TwoViews s{
      .camera = camera, .rig = rig, .samples = exact_samples(trajectory, rate_hz, bias), .anchor = {}, .observer = {}};

  const double t_anchor_s = 0.25 + 0.1 * random.uniform(2);
  const auto view = [&](double t_cam_s, const Eigen::Vector3d& P_W) -> std::optional<SceneView> {
    const sim::FrameView frame(trajectory, s.camera, rig, sim::half_angle_of_view_rad(s.camera), t_cam_s);
    const auto exposure = frame.expose(P_W);
    if (!exposure || !s.camera.contains(exposure->pixel)) return std::nullopt;
    SceneView v{.t_cam_s = t_cam_s};
    const double state_s = t_cam_s + rig.td_s + 0.012 * (random.uniform(3, t_cam_s > t_anchor_s ? 1 : 0) - 0.5);
    v.state_index = static_cast<std::size_t>(std::llround(state_s * rate_hz));
    const double s_k = core::to_seconds((*s.samples)[v.state_index].t_ns);
    v.offset_s = t_cam_s - s_k;
    v.state = state_at(trajectory, s_k, bias);
    v.pixel = exposure->pixel;
    v.velocity = frame.image_velocity(P_W, exposure->t_imu_s);
    v.bearing = s.camera.unproject(v.pixel);
    v.inverse_depth = 1.0 / exposure->depth_m;
    const Eigen::Vector3d P_C = (v.state.T_W_B * rig.T_B_C).inverse() * P_W;
    v.bearing_at_state = P_C / P_C.z();
    v.inverse_depth_at_state = 1.0 / P_C.z();
    return v;
  };
  // The first landmark of the stream that both see.
  for (std::uint64_t k = 0; k < 1000; ++k) {
    const Eigen::Vector2d pixel(640.0 * random.uniform(4, k), 480.0 * random.uniform(5, k));
    const double depth_m = 2.0 + 4.0 * random.uniform(6, k);
    const core::Pose T_W_C = trajectory.pose_at(t_anchor_s + rig.td_s) * rig.T_B_C;
    const Eigen::Vector3d P_W = T_W_C * (depth_m * s.camera.unproject(pixel));
    const auto anchor = view(t_anchor_s, P_W);
    const auto observer = view(t_anchor_s + 0.3, P_W);
    if (!anchor || !observer) continue;
    s.anchor = *anchor;
    s.observer = *observer;
    return s;
  }
  throw std::logic_error("two_views: no landmark is seen twice");
}

}  // namespace plumbline::testing
