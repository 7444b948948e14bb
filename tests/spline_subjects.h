// The factors of a trajectory spline as subjects of the laws. The scenes' motion is a spline itself (sim), so that
// nothing is left at the truth.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <memory>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include <ceres/dynamic_autodiff_cost_function.h>

#include "core/random.h"
#include "estimator/factors/spline_factors.h"
#include "factor_subject.h"
#include "imu_subjects.h"
#include "line_scene.h"
#include "line_subjects.h"
#include "plain_spline.h"
#include "point_scene.h"
#include "point_subjects.h"
#include "prior_subjects.h"
#include "rig_blocks.h"
#include "sim/spline_trajectory.h"

namespace plumbline::testing {

using estimator::BiasBlock;
using estimator::SplineInstant;
using estimator::SplineKnots;
using estimator::SplineVisual;

inline const core::RandomStream kSplineRandom({53, 0}, "spline_factors_test");
inline constexpr double kSplineIntervalS = 0.1;
inline constexpr int kSplineSegments = 20;

inline SplineKnots scene_knots(int order = 6) {
  return {.interval_s = kSplineIntervalS, .order = order, .segments = kSplineSegments};
}

// A walk of 0.5 m/s and 0.8 rad/s; strength 0 is rest.
inline std::vector<core::Pose> scene_controls(std::uint64_t scene, double strength = 1.0) {
  std::vector<core::Pose> controls = {
      {core::exp_quaternion(kSplineRandom.normal3(scene, 0)), kSplineRandom.normal3(scene, 1)}};
  for (std::uint64_t j = 1; j < kSplineSegments + 5; ++j) {
    const core::Pose& last = controls.back();
    controls.push_back({last.q * core::exp_quaternion(0.08 * strength * kSplineRandom.normal3(scene, 2 * j)),
                        last.p + 0.05 * strength * kSplineRandom.normal3(scene, 2 * j + 1)});
  }
  return controls;
}

// Blocks and reference of a factor on the controls of a segment or two.
template <class Plain>
FactorScene spline_scene(std::unique_ptr<ceres::CostFunction> factor, const Plain& plain, std::vector<Block> blocks) {
  auto reference = std::make_unique<ceres::DynamicAutoDiffCostFunction<Plain, 8>>(new Plain(plain));
  for (const Block& b : blocks) reference->AddParameterBlock(static_cast<int>(b.values.size()));
  reference->SetNumResiduals(factor->num_residuals());
  return {std::move(factor), std::move(reference), std::move(blocks)};
}

inline std::vector<Block> control_blocks(const std::vector<core::Pose>& controls, const std::vector<int>& which,
                                         const core::Pose& T_new_W) {
  std::vector<Block> blocks;
  for (const int c : which) blocks.push_back(pose_block(T_new_W * controls[static_cast<std::size_t>(c)]));
  return blocks;
}

// Where a segment's controls are among the blocks of `which`.
inline PlainSegmentPath plain_path(const SplineKnots& knots, int segment, const std::vector<int>& which) {
  PlainSegmentPath path{knots.order, knots.interval_s, segment, {}};
  for (int j = 0; j < knots.order; ++j) {
    path.controls.push_back(
        static_cast<std::size_t>(std::find(which.begin(), which.end(), segment + j) - which.begin()));
  }
  return path;
}

inline void displace_blocks(std::vector<Block>& blocks, std::uint64_t scene) {
  for (std::size_t k = 0; k < blocks.size(); ++k) {
    displace(blocks[k], blocks[k].values.size() == 1 ? 1e-3 : 0.01, kSplineRandom, 500 + scene, k);
  }
}

struct PointRequest {
  estimator::LandmarkType landmark = estimator::LandmarkType::kBearingInverseDepth;
  estimator::ResidualType residual = estimator::ResidualType::kPinhole;
  int order = 6;
  double readout_s = 0.03;
  double strength = 1.0;
  double apart_s = 0.0;  // of the observer's frame, before what two_views chose; its controls are shared then
  std::optional<double> inverse_depth = std::nullopt;  // in place of the true inverse depth
};

inline FactorScene spline_point_scene(const PointRequest& p, const SceneRequest& request) {
  std::vector<core::Pose> controls = scene_controls(request.scene, p.strength);
  const SplineKnots knots = scene_knots(p.order);
  const sim::SplineTrajectory trajectory(controls, kSplineIntervalS);
  const TwoViews s =
      two_views(trajectory, scene_rig(p.readout_s), scene_camera(core::DistortionModel::kNone), request.scene, 200.0);
  const bool fixed = p.landmark == estimator::LandmarkType::kFixedBearing;
  const estimator::CameraModel model{s.camera, kSigmaPx, kGravity, p.residual};
  const Eigen::Vector2d pixel =
      s.observer.pixel + kSigmaPx * request.noise * kSplineRandom.normal2(1000 + request.draw, 0);
  const auto end = [&](const SceneView& v, double later_s) -> SplineVisual::End {
    const double t_cam_s = v.t_cam_s + later_s;
    const double row_s = core::row_phase(v.pixel.y(), s.camera.height_px) * s.rig.readout_s;
    return {t_cam_s, knots.segment(t_cam_s + s.rig.td_s + row_s)};
  };
  const SplineVisual::End anchor = end(s.anchor, 0.0);
  const SplineVisual::End observer = end(s.observer, -p.apart_s);
  const std::vector<int> which = estimator::SegmentPair(knots, {anchor.segment, observer.segment}).controls();
  PlainSplinePoint plain{{p.residual, s.camera, kSigmaPx, pixel},
                         {plain_path(knots, anchor.segment, which), plain_path(knots, observer.segment, which)},
                         {anchor.t_cam_s, observer.t_cam_s},
                         which.size(),
                         pixel};
  std::vector<Block> blocks = control_blocks(controls, which, {});
  const Eigen::Vector3d landmark(s.anchor.bearing.x(), s.anchor.bearing.y(),
                                 p.inverse_depth.value_or(s.anchor.inverse_depth));
  blocks.insert(blocks.end(), {pose_block(s.rig.T_B_C), scalar_block(s.rig.td_s), scalar_block(s.rig.readout_s),
                               fixed ? scalar_block(landmark.z()) : block(landmark, nullptr, 1e-4)});
  if (request.off_truth) displace_blocks(blocks, request.scene);
  for (std::size_t k = 0; k < which.size(); ++k) {
    blocks[k].values = pose_block(request.T_new_W * estimator::unpack_pose(blocks[k].values.data())).values;
  }
  std::unique_ptr<SplineVisual> factor;
  if (fixed) {
    plain.anchor_pixel = s.anchor.pixel;
    factor = std::make_unique<estimator::SplinePoint<estimator::LandmarkType::kFixedBearing>>(
        model, knots, anchor, observer, pixel, s.anchor.pixel);
  } else {
    factor = std::make_unique<estimator::SplinePoint<estimator::LandmarkType::kBearingInverseDepth>>(
        model, knots, anchor, observer, pixel);
  }
  return spline_scene(std::move(factor), plain, std::move(blocks));
}

inline FactorScene spline_line_scene(const SceneRequest& request, double readout_s = 0.03, double strength = 1.0) {
  const std::vector<core::Pose> controls = scene_controls(request.scene, strength);
  const SplineKnots knots = scene_knots();
  const sim::SplineTrajectory trajectory(controls, kSplineIntervalS);
  const LineView v =
      line_view(trajectory, scene_rig(readout_s), scene_camera(core::DistortionModel::kNone), request.scene, 0.0);
  const Eigen::Vector3d origin = request.T_new_W * v.origin_W;
  const estimator::SegmentPixels pixels = noisy_segment(v.pixels, request);
  const double t_cam_s = core::to_seconds((*v.samples)[v.state_index].t_ns) + v.offset_s;
  std::array<SplineVisual::End, 2> ends;
  for (std::size_t k = 0; k < 2; ++k) {
    const double row_s = core::row_phase(v.pixels[k].y(), v.camera.height_px) * v.rig.readout_s;
    ends[k] = {t_cam_s, knots.segment(t_cam_s + v.rig.td_s + row_s)};
  }
  const std::vector<int> which = estimator::SegmentPair(knots, {ends[0].segment, ends[1].segment}).controls();
  std::vector<Block> blocks = control_blocks(controls, which, {});
  blocks.insert(blocks.end(), {pose_block(v.rig.T_B_C), scalar_block(v.rig.td_s), scalar_block(v.rig.readout_s),
                               block(v.line, &kLineManifold)});
  if (request.off_truth) displace_blocks(blocks, request.scene);
  for (std::size_t k = 0; k < which.size(); ++k) {
    blocks[k].values = pose_block(request.T_new_W * estimator::unpack_pose(blocks[k].values.data())).values;
  }
  move_line(request.T_new_W, blocks.back());
  const estimator::CameraModel model = line_model(v);
  const PlainSplineLine plain{{model.camera, model.pixel_sigma_px, pixels},
                              origin,
                              {plain_path(knots, ends[0].segment, which), plain_path(knots, ends[1].segment, which)},
                              t_cam_s,
                              which.size()};
  return spline_scene(std::make_unique<estimator::SplineLine>(model, knots, ends, origin, pixels), plain,
                      std::move(blocks));
}

// The controls of an instant's segment and its two biases.
struct InstantScene {
  InstantScene(const SceneRequest& request, int order, double strength = 1.0)
      : knots(scene_knots(order)), at{.t_s = 0.5 + 0.0137 * static_cast<double>(request.scene), .bias_share = 0.3} {
    at.segment = knots.segment(at.t_s);
    std::vector<int> which(static_cast<std::size_t>(order));
    std::iota(which.begin(), which.end(), at.segment);
    const auto controls = scene_controls(request.scene, strength);
    blocks = control_blocks(controls, which, {});
    for (std::uint64_t k = 0; k < 2; ++k) {
      BiasBlock b;
      b << 0.02 * kSplineRandom.normal3(900 + request.scene, k), 0.1 * kSplineRandom.normal3(950 + request.scene, k);
      blocks.push_back(block(b));
    }
    std::iota(which.begin(), which.end(), 0);
    path = plain_path({kSplineIntervalS, order, kSplineSegments}, 0, which);
    path.segment = at.segment;
    state = estimator::spline_state(knots, at, pointers(blocks).data());
    if (request.off_truth) displace_blocks(blocks, request.scene);
    for (std::size_t k = 0; k < static_cast<std::size_t>(order); ++k) {
      blocks[k].values = pose_block(request.T_new_W * estimator::unpack_pose(blocks[k].values.data())).values;
    }
  }

  SplineKnots knots;
  SplineInstant at;
  std::vector<Block> blocks;
  PlainSegmentPath path;
  core::State state;  // at the truth
};

inline FactorScene spline_imu_scene(const SceneRequest& request, int order, double strength = 1.0) {
  constexpr double kDt = 0.005;
  InstantScene s(request, order, strength);
  core::ImuSample sample;
  if (order == 6) {
    const sim::Kinematics x =
        sim::SplineTrajectory(scene_controls(request.scene, strength), kSplineIntervalS).at(s.at.t_s);
    sample.gyro_rad_s = x.omega_B + s.state.bias.gyro_rad_s;
    sample.accel_m_s2 = x.T_W_B.q.conjugate() * (x.a_W + Eigen::Vector3d(0, 0, kGravity)) + s.state.bias.accel_m_s2;
  }
  const Eigen::Vector2d sigma =
      Eigen::Vector2d(kImuNoise.gyro_noise_density, kImuNoise.accel_noise_density) / std::sqrt(kDt);
  sample.gyro_rad_s += request.noise * sigma[0] * kSplineRandom.normal3(1100 + request.draw, 0);
  sample.accel_m_s2 += request.noise * sigma[1] * kSplineRandom.normal3(1100 + request.draw, 1);
  const PlainSplineImu plain{s.path, s.at.t_s, s.at.bias_share, sample, sigma, kGravity};
  return spline_scene(std::make_unique<estimator::SplineImu>(s.knots, s.at, sample, kImuNoise, kDt, kGravity), plain,
                      std::move(s.blocks));
}

inline FactorScene spline_state_scene(const SceneRequest& request, int order) {
  InstantScene s(request, order);
  core::StateTangent n;
  for (std::uint64_t i = 0; i < 5; ++i) {
    n.segment<3>(3 * static_cast<int>(i)) = request.noise * kSplineRandom.normal3(4000 + request.draw, i);
  }
  const core::State mean = core::plus(s.state, n.cwiseProduct(kStateSigmas.per_axis()));
  const PlainSplineState plain{s.path, s.at.t_s, s.at.bias_share, mean, kStateSigmas.per_axis()};
  return spline_scene(std::make_unique<estimator::SplineState>(s.knots, s.at, mean, kStateSigmas), plain,
                      std::move(s.blocks));
}

inline FactorScene bias_walk_scene(const SceneRequest& request) {
  constexpr double kInterval = 0.2;
  BiasBlock sigma;
  sigma << Eigen::Vector3d::Constant(kImuNoise.gyro_bias_walk * std::sqrt(kInterval)),
      Eigen::Vector3d::Constant(kImuNoise.accel_bias_walk * std::sqrt(kInterval));
  BiasBlock from;
  from << kSplineRandom.normal3(70 + request.scene, 0), kSplineRandom.normal3(70 + request.scene, 1);
  BiasBlock n;
  n << kSplineRandom.normal3(5000 + request.draw, 0), kSplineRandom.normal3(5000 + request.draw, 1);
  const BiasBlock to = from + request.noise * sigma.cwiseProduct(n);
  FactorScene s{std::make_unique<estimator::BiasWalk>(kImuNoise, kInterval),
                automatic<PlainBiasWalk, 6, 6, 6>({sigma}),
                {block(from), block(to)}};
  if (request.off_truth) displace_blocks(s.blocks, request.scene);
  return s;
}

inline std::vector<FactorSubject> spline_subjects() {
  using estimator::LandmarkType;
  using estimator::ResidualType;
  std::vector<FactorSubject> result;
  const auto add = [&](std::string name, std::function<FactorScene(const SceneRequest&)> scene,
                       std::vector<std::function<FactorScene()>> limits, bool in_world) {
    // Rounding, whitened by 1e5.
    result.push_back(
        {.name = std::move(name),
         .scene = std::move(scene),
         .limits =
             [limits] {
               std::vector<FactorScene> scenes;
               for (const auto& limit : limits) scenes.push_back(limit());
               return scenes;
             },
         .zero_tolerance = 1e-8,
         // A control at the end of its basis has a share of as little as 1e-8, beside rounding of the whole.
         .automatic_tolerance = 1e-9,
         .zero_floor = 1e-2,
         .in_world = in_world});
  };
  for (const ResidualType residual : {ResidualType::kPinhole, ResidualType::kUnitSphere}) {
    for (const LandmarkType landmark : {LandmarkType::kBearingInverseDepth, LandmarkType::kFixedBearing}) {
      const PointRequest p{.landmark = landmark, .residual = residual};
      const auto at = [p](auto change) {
        return [p, change] {
          PointRequest changed = p;
          change(changed);
          return spline_point_scene(changed, {.scene = 1});
        };
      };
      add(
          std::string("Point") + (residual == ResidualType::kPinhole ? "Pinhole" : "UnitSphere") +
              (landmark == LandmarkType::kFixedBearing ? "Fixed" : "Bearing"),
          [p](const SceneRequest& r) { return spline_point_scene(p, r); },
          {at([](PointRequest& c) { c.strength = 0.0; }), at([](PointRequest& c) { c.readout_s = 0.0; }),
           at([](PointRequest& c) { c.inverse_depth = 0.0; }), at([](PointRequest& c) { c.order = 4; }),
           at([](PointRequest& c) { c.order = 5; }),
           // All controls shared, and none.
           at([](PointRequest& c) { c.apart_s = 0.3; }), at([](PointRequest& c) { c.apart_s = -0.6; })},
          true);
    }
  }
  add(
      "Line", [](const SceneRequest& r) { return spline_line_scene(r); },
      {[] { return spline_line_scene({.scene = 1}, 0.0); }, [] { return spline_line_scene({.scene = 1}, 0.03, 0.0); }},
      true);
  add(
      "Imu", [](const SceneRequest& r) { return spline_imu_scene(r, 6); },
      {[] { return spline_imu_scene({.scene = 1}, 6, 0.0); }, [] { return spline_imu_scene({.scene = 1}, 4); },
       [] { return spline_imu_scene({.scene = 1}, 5, 20.0); }},
      true);
  add(
      "State", [](const SceneRequest& r) { return spline_state_scene(r, 6); },
      {[] { return spline_state_scene({.scene = 1}, 4); }}, false);
  add(
      "BiasWalk", [](const SceneRequest& r) { return bias_walk_scene(r); }, {[] { return bias_walk_scene({}); }},
      false);
  return result;
}

}  // namespace plumbline::testing
