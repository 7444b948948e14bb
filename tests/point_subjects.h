// The point factors of both timing models, both residuals and both forms of a landmark, without and with a lens, as
// subjects of the laws.
#pragma once

#include <cmath>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include "core/random.h"
#include "estimator/factors/feature_velocity.h"
#include "estimator/factors/point_factors.h"
#include "factor_subject.h"
#include "plain_points.h"
#include "point_scene.h"
#include "rig_blocks.h"

namespace plumbline::testing {

using core::DistortionModel;
using estimator::AnchorPointFactor;
using estimator::CameraModel;
using estimator::FeatureVelocityAnchor;
using estimator::FeatureVelocityPoint;
using estimator::FrameTiming;
using estimator::LandmarkType;
using estimator::LocalMotion;
using estimator::MovingBearing;
using estimator::PropagatedPoint;
using estimator::PropagatedPointFactor;
using estimator::RayChart;
using estimator::ResidualType;

inline constexpr double kSigmaPx = 0.7;
inline constexpr double kReadoutS = 0.03;
inline constexpr double kFineHz = 1000.0;
inline const core::RandomStream kPointRandom({7, 0}, "point_factors_test");

enum class Motion { kHandheld, kSideways, kRest };

// The scenes of a motion; `fine` samples the IMU so densely that the midpoint rule's own error vanishes.
inline const TwoViews& scene_views(Motion motion, DistortionModel lens, std::uint64_t index, bool fine,
                                   double readout_s = kReadoutS) {
  static std::map<std::tuple<Motion, DistortionModel, std::uint64_t, bool, double>, TwoViews> cache;
  const auto key = std::tuple(motion, lens, index, fine, readout_s);
  const auto found = cache.find(key);
  if (found != cache.end()) return found->second;
  const core::RigCalibration rig = scene_rig(readout_s);
  const core::PinholeCamera camera = scene_camera(lens);
  const double rate_hz = fine ? kFineHz : 200.0;
  if (motion == Motion::kHandheld) {
    sim::TrajectoryConfig c;
    c.handheld.rate_rms_rad_s = 0.75;
    const auto trajectory = sim::make_trajectory(c, 1.0, {40 + index, 0});
    return cache.emplace(key, two_views(*trajectory, rig, camera, index, rate_hz)).first->second;
  }
  const Eigen::Vector2d velocity_C =
      motion == Motion::kRest ? Eigen::Vector2d::Zero() : Eigen::Vector2d(0.5, -0.4 + 0.1 * static_cast<double>(index));
  const core::Pose start{.q = core::exp_quaternion(Eigen::Vector3d(0.1, -0.2, 0.3))};
  const SlidingMotion trajectory(rig.T_B_C, start, velocity_C);
  return cache.emplace(key, two_views(trajectory, rig, camera, index, rate_hz)).first->second;
}

struct Variant {
  ResidualType residual;
  LandmarkType landmark;
  DistortionModel lens = DistortionModel::kNone;
  bool fixed() const { return landmark == LandmarkType::kFixedBearing; }
};

// The blocks of both timing models at the truth; landmark is (x, y, lambda).
inline std::vector<Block> blocks_of(const TwoViews& s, const Variant& variant, const Eigen::Vector3d& landmark) {
  // Time crosses the steps of the IMU's samples within 2.5 ms, where the third derivative jumps: small steps in td and
  // readout, and in what moves the row.
  std::vector<Block> blocks = {state_block(s.anchor.state), state_block(s.observer.state), pose_block(s.rig.T_B_C),
                               scalar_block(s.rig.td_s, 2e-5), scalar_block(s.rig.readout_s, 2e-5)};
  blocks.push_back(variant.fixed() ? scalar_block(landmark.z()) : block(landmark, nullptr, 1e-4));
  return blocks;
}

inline void displace_all(std::vector<Block>& blocks, std::uint64_t index) {
  for (std::size_t k = 0; k < blocks.size(); ++k) {
    const double scale = k == 3 || k == 4 ? 1e-3 : 0.01;
    displace(blocks[k], scale, kPointRandom, 100 + index, k);
  }
}

// Factor and reference of timing `propagated`. The tables are linear in the biases about their own, the reference is
// not: so they are made at the biases of the blocks.
inline FactorScene propagated_scene(const TwoViews& s, const Variant& variant, std::vector<Block> blocks,
                                    const Eigen::Vector2d& pixel) {
  const CameraModel model{s.camera, kSigmaPx, kGravity, variant.residual};
  const auto timing = [&](const SceneView& v, const Block& state) -> FrameTiming {
    const core::ImuBias bias = estimator::unpack_state(state.values.data()).bias;
    return {std::make_shared<LocalMotion>(*s.samples, v.state_index, 0.03, bias), v.offset_s};
  };
  const auto plain_frame = [&](const SceneView& v) -> PlainFrame {
    return {s.samples, v.state_index, v.offset_s, kGravity};
  };
  const FrameTiming anchor = timing(s.anchor, blocks[0]);
  const FrameTiming observer = timing(s.observer, blocks[1]);
  PlainPropagatedPoint plain{
      {variant.residual, s.camera, kSigmaPx, pixel}, plain_frame(s.anchor), plain_frame(s.observer), pixel};
  FactorScene scene;
  if (variant.fixed()) {
    plain.anchor_pixel = s.anchor.pixel;
    scene.factor =
        std::make_unique<PropagatedPoint<LandmarkType::kFixedBearing>>(model, anchor, observer, pixel, s.anchor.pixel);
    scene.reference = automatic<PlainPropagatedPoint, 2, 16, 16, 7, 1, 1, 1>(plain);
  } else {
    scene.factor = std::make_unique<PropagatedPointFactor>(model, anchor, observer, pixel);
    scene.reference = automatic<PlainPropagatedPoint, 2, 16, 16, 7, 1, 1, 3>(plain);
  }
  scene.blocks = std::move(blocks);
  return scene;
}

inline FactorScene feature_velocity_scene(const TwoViews& s, const Variant& variant, std::vector<Block> blocks,
                                          const Eigen::Vector2d& pixel) {
  const RayChart chart(variant.residual, s.camera, kSigmaPx, pixel);
  const MovingBearing observed(s.camera, s.observer.offset_s, pixel, s.observer.velocity);
  const MovingBearing anchor(s.camera, s.anchor.offset_s, s.anchor.pixel, s.anchor.velocity);
  PlainFeatureVelocityPoint plain{{variant.residual, s.camera, kSigmaPx, pixel},
                                  {s.camera, -s.observer.offset_s, pixel, s.observer.velocity}};
  FactorScene scene;
  if (variant.fixed()) {
    plain.anchor = PlainMovingBearing{s.camera, -s.anchor.offset_s, s.anchor.pixel, s.anchor.velocity};
    scene.factor = std::make_unique<FeatureVelocityPoint<LandmarkType::kFixedBearing>>(chart, observed, anchor);
    scene.reference = automatic<PlainFeatureVelocityPoint, 2, 16, 16, 7, 1, 1, 1>(plain);
  } else {
    scene.factor = std::make_unique<FeatureVelocityPoint<LandmarkType::kBearingInverseDepth>>(chart, observed);
    scene.reference = automatic<PlainFeatureVelocityPoint, 2, 16, 16, 7, 1, 1, 3>(plain);
  }
  scene.blocks = std::move(blocks);
  return scene;
}

using Build = FactorScene (*)(const TwoViews&, const Variant&, std::vector<Block>, const Eigen::Vector2d&);

inline Eigen::Vector3d true_landmark(const TwoViews& s, Build build) {
  const SceneView& a = s.anchor;
  return build == propagated_scene
             ? Eigen::Vector3d(a.bearing.x(), a.bearing.y(), a.inverse_depth)
             : Eigen::Vector3d(a.bearing_at_state.x(), a.bearing_at_state.y(), a.inverse_depth_at_state);
}

// A fixed bearing is believed to be exact, so that only the observer's noise is what the factor believes in.
inline std::function<FactorScene(const SceneRequest&)> point_scenes(Build build, Motion motion,
                                                                    const Variant& variant) {
  return [=](const SceneRequest& request) {
    const TwoViews& s = scene_views(motion, variant.lens, request.scene, !request.off_truth);
    std::vector<Block> blocks = blocks_of(s, variant, true_landmark(s, build));
    if (request.off_truth) displace_all(blocks, request.scene);
    for (const std::size_t k : {0U, 1U}) move_state(request.T_new_W, blocks[k]);
    const Eigen::Vector2d noise = kSigmaPx * request.noise * kPointRandom.normal2(1000 + request.draw);
    return build(s, variant, std::move(blocks), s.observer.pixel + noise);
  };
}

inline std::function<std::vector<FactorScene>()> point_limits(Build build, const Variant& variant) {
  return [=] {
    std::vector<FactorScene> result;
    const auto add = [&](const TwoViews& s, double inverse_depth) {
      Eigen::Vector3d landmark = true_landmark(s, build);
      landmark.z() = inverse_depth;
      result.push_back(build(s, variant, blocks_of(s, variant, landmark), s.observer.pixel));
    };
    const DistortionModel lens = variant.lens;
    for (const double inverse_depth : {0.0, -1e-3, 1e-9, 2.0}) {
      add(scene_views(Motion::kSideways, lens, 1, false), inverse_depth);
    }
    add(scene_views(Motion::kHandheld, lens, 1, false), 0.0);
    // No motion at all: neither rotation nor parallax; and no readout.
    add(scene_views(Motion::kRest, lens, 1, false), 0.2);
    add(scene_views(Motion::kHandheld, lens, 2, false, 0.0), 0.2);
    return result;
  };
}

inline FactorScene anchor_scene(ResidualType residual, DistortionModel lens, bool moving, const SceneRequest& request) {
  const TwoViews& s = scene_views(Motion::kSideways, lens, request.scene, !request.off_truth);
  const SceneView& a = s.anchor;
  const Eigen::Vector2d pixel = a.pixel + kSigmaPx * request.noise * kPointRandom.normal2(2000 + request.draw);
  FactorScene scene;
  if (moving) {
    scene.factor = std::make_unique<FeatureVelocityAnchor>(RayChart(residual, s.camera, kSigmaPx, pixel),
                                                           MovingBearing(s.camera, a.offset_s, pixel, a.velocity));
    scene.reference = automatic<PlainFeatureVelocityAnchor, 2, 1, 1, 3>(
        {{residual, s.camera, kSigmaPx, pixel}, {s.camera, -a.offset_s, pixel, a.velocity}});
    scene.blocks = {scalar_block(s.rig.td_s), scalar_block(s.rig.readout_s)};
  } else {
    scene.factor = std::make_unique<AnchorPointFactor>(CameraModel{s.camera, kSigmaPx, kGravity, residual}, pixel);
    scene.reference = automatic<PlainAnchorPoint, 2, 3>({{residual, s.camera, kSigmaPx, pixel}, pixel});
  }
  const Eigen::Vector3d b = moving ? a.bearing_at_state : a.bearing;
  scene.blocks.push_back(block(Eigen::Vector3d(b.x(), b.y(), a.inverse_depth)));
  if (request.off_truth) {
    for (std::size_t k = 0; k < scene.blocks.size(); ++k) {
      displace(scene.blocks[k], 0.01, kPointRandom, 100 + request.scene, k);
    }
  }
  return scene;
}

inline std::vector<FactorSubject> point_subjects() {
  std::vector<FactorSubject> result;
  const auto add_observations = [&](const Variant& variant, const std::string& name) {
    // What is left at the truth is the midpoint rule's error over the gap, at 1 kHz.
    result.push_back({.name = "Propagated" + name,
                      .scene = point_scenes(propagated_scene, Motion::kHandheld, variant),
                      .limits = point_limits(propagated_scene, variant),
                      .zero_tolerance = 2e-4});
    result.push_back({.name = "FeatureVelocity" + name,
                      .scene = point_scenes(feature_velocity_scene, Motion::kSideways, variant),
                      .limits = point_limits(feature_velocity_scene, variant)});
  };
  const auto add_anchor = [&](ResidualType residual, DistortionModel lens, bool moving, const std::string& name) {
    const auto scene = [=](const SceneRequest& r) { return anchor_scene(residual, lens, moving, r); };
    result.push_back({.name = name,
                      .scene = scene,
                      .limits =
                          [=] {
                            std::vector<FactorScene> at_limits;
                            at_limits.push_back(scene({}));
                            return at_limits;
                          },
                      .in_world = false});
  };
  for (const DistortionModel lens : {DistortionModel::kNone, DistortionModel::kRadtan}) {
    for (const ResidualType residual : {ResidualType::kPinhole, ResidualType::kUnitSphere}) {
      const std::string surface = std::string(residual == ResidualType::kPinhole ? "Pinhole" : "UnitSphere") +
                                  (lens == DistortionModel::kNone ? "" : "Radtan");
      for (const LandmarkType landmark : {LandmarkType::kBearingInverseDepth, LandmarkType::kFixedBearing}) {
        const Variant variant{residual, landmark, lens};
        add_observations(variant, surface + (variant.fixed() ? "Fixed" : "Bearing"));
      }
      add_anchor(residual, lens, false, "Anchor" + surface);
      add_anchor(residual, lens, true, "FeatureVelocityAnchor" + surface);
    }
  }
  return result;
}

}  // namespace plumbline::testing
