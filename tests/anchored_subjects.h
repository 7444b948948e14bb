// Points that are tied to a state, of both timing models, seen from another state and from their own, as subjects of
// the laws.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "estimator/factors/anchored_point.h"
#include "point_subjects.h"

namespace plumbline::testing {

using estimator::AnchoredPoint;
using estimator::FreeCameraSight;
using estimator::OwnAnchoredPoint;
using estimator::PropagatedSight;
using estimator::VelocitySight;

struct AnchoredVariant {
  Variant look;
  bool propagated = true;
  bool own = false;          // the observer is the anchor
  bool free_camera = false;  // its intrinsics are estimated
};

inline FactorScene anchored_scene(const TwoViews& s, const AnchoredVariant& variant, std::vector<Block> blocks,
                                  const Eigen::Vector2d& pixel) {
  const SceneView& view = variant.own ? s.anchor : s.observer;
  const CameraModel model{s.camera, kSigmaPx, kGravity, variant.look.residual};
  const core::Pose& T_B_A = s.rig.T_B_C;
  FactorScene scene;
  if (variant.propagated) {
    const core::ImuBias bias = estimator::unpack_state(blocks[variant.own ? 0 : 1].values.data()).bias;
    const FrameTiming timing{std::make_shared<LocalMotion>(*s.samples, view.state_index, 0.03, bias), view.offset_s};
    const PlainFrame frame{s.samples, view.state_index, view.offset_s, kGravity};
    const PlainPropagatedPoint plain{.reduction = {variant.look.residual, s.camera, kSigmaPx, pixel},
                                     .anchor = frame,
                                     .observer = frame,
                                     .observed_pixel = pixel,
                                     .T_B_A = T_B_A};
    // The unit sphere has no pixels.
    const CameraModel in_pixels{s.camera, kSigmaPx, kGravity};
    const PropagatedSight sight(model, timing, pixel);
    const FreeCameraSight free(in_pixels, timing, pixel);
    if (variant.free_camera && variant.own) {
      scene.factor = std::make_unique<OwnAnchoredPoint<FreeCameraSight>>(free, T_B_A);
      scene.reference = automatic<PlainOwn<PlainFreeCameraPoint>, 2, 16, 7, 1, 1, 3, 4>({{plain}});
    } else if (variant.free_camera) {
      scene.factor = std::make_unique<AnchoredPoint<FreeCameraSight>>(free, T_B_A);
      scene.reference = automatic<PlainFreeCameraPoint, 2, 16, 16, 7, 1, 1, 3, 4>({plain});
    } else if (variant.own) {
      scene.factor = std::make_unique<OwnAnchoredPoint<PropagatedSight>>(sight, T_B_A);
      scene.reference = automatic<PlainOwn<PlainPropagatedPoint>, 2, 16, 7, 1, 1, 3>({plain});
    } else {
      scene.factor = std::make_unique<AnchoredPoint<PropagatedSight>>(sight, T_B_A);
      scene.reference = automatic<PlainPropagatedPoint, 2, 16, 16, 7, 1, 1, 3>(plain);
    }
  } else {
    const VelocitySight sight(RayChart(variant.look.residual, s.camera, kSigmaPx, pixel),
                              MovingBearing(s.camera, view.offset_s, pixel, view.velocity));
    const PlainFeatureVelocityPoint plain{.reduction = {variant.look.residual, s.camera, kSigmaPx, pixel},
                                          .observed = {s.camera, -view.offset_s, pixel, view.velocity},
                                          .T_B_A = T_B_A};
    if (variant.own) {
      scene.factor = std::make_unique<OwnAnchoredPoint<VelocitySight>>(sight, T_B_A);
      scene.reference = automatic<PlainOwn<PlainFeatureVelocityPoint>, 2, 16, 7, 1, 1, 3>({plain});
    } else {
      scene.factor = std::make_unique<AnchoredPoint<VelocitySight>>(sight, T_B_A);
      scene.reference = automatic<PlainFeatureVelocityPoint, 2, 16, 16, 7, 1, 1, 3>(plain);
    }
  }
  scene.blocks = std::move(blocks);
  return scene;
}

inline FactorSubject anchored_subject(const AnchoredVariant& variant, const std::string& name) {
  const Motion motion = variant.propagated ? Motion::kHandheld : Motion::kSideways;
  const auto build = [=](const TwoViews& s, double inverse_depth, const SceneRequest& request) {
    const SceneView& a = s.anchor;
    std::vector<Block> blocks =
        blocks_of(s, variant.look, {a.bearing_at_state.x(), a.bearing_at_state.y(), inverse_depth});
    if (request.off_truth) displace_all(blocks, request.scene);
    for (const std::size_t k : {0U, 1U}) move_state(request.T_new_W, blocks[k]);
    if (variant.own) blocks.erase(blocks.begin() + 1);
    if (variant.free_camera) {
      blocks.push_back(block(s.camera.intrinsics(), nullptr, 0.1));
      if (request.off_truth) displace(blocks.back(), 3.0, kPointRandom, 100 + request.scene, 6);
    }
    const Eigen::Vector2d noise = kSigmaPx * request.noise * kPointRandom.normal2(1000 + request.draw);
    return anchored_scene(s, variant, std::move(blocks), (variant.own ? s.anchor : s.observer).pixel + noise);
  };
  const DistortionModel lens = variant.look.lens;
  return {.name = name,
          .scene =
              [=](const SceneRequest& request) {
                const TwoViews& s = scene_views(motion, lens, request.scene, !request.off_truth);
                return build(s, s.anchor.inverse_depth_at_state, request);
              },
          .limits =
              [=] {
                std::vector<FactorScene> result;
                for (const double inverse_depth : {0.0, -1e-3, 1e-9, 2.0}) {
                  result.push_back(build(scene_views(Motion::kSideways, lens, 1, false), inverse_depth, {}));
                }
                result.push_back(build(scene_views(Motion::kRest, lens, 1, false), 0.2, {}));
                result.push_back(build(scene_views(Motion::kHandheld, lens, 2, false, 0.0), 0.2, {}));
                return result;
              },
          // What is left at the truth is the midpoint rule's error over the gap, at 1 kHz.
          .zero_tolerance = variant.propagated ? 2e-4 : 1e-9,
          // From its own state a point is seen by two ways that nearly cancel, and by `feature_velocity` quite.
          .automatic_tolerance = variant.own ? 1e-8 : 1e-10,
          .zero_floor = variant.own && !variant.propagated ? 1.0 : 1e-12};
}

inline std::vector<FactorSubject> anchored_subjects() {
  std::vector<FactorSubject> result;
  for (const DistortionModel lens : {DistortionModel::kNone, DistortionModel::kRadtan}) {
    for (const bool own : {false, true}) {
      const Variant look{ResidualType::kPinhole, LandmarkType::kBearingInverseDepth, lens};
      const std::string name =
          std::string(own ? "Own" : "") + "FreeCamera" + (lens == DistortionModel::kNone ? "" : "Radtan");
      result.push_back(anchored_subject({look, true, own, true}, name));
    }
    for (const ResidualType residual : {ResidualType::kPinhole, ResidualType::kUnitSphere}) {
      for (const bool propagated : {true, false}) {
        for (const bool own : {false, true}) {
          const Variant look{residual, LandmarkType::kBearingInverseDepth, lens};
          const std::string name = std::string(own ? "Own" : "") + (propagated ? "Propagated" : "FeatureVelocity") +
                                   (residual == ResidualType::kPinhole ? "Pinhole" : "UnitSphere") +
                                   (lens == DistortionModel::kNone ? "" : "Radtan");
          result.push_back(anchored_subject({look, propagated, own}, name));
        }
      }
    }
  }
  return result;
}

}  // namespace plumbline::testing
