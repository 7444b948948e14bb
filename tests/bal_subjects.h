// The bundle-adjustment factors of both forms as subjects of the laws.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "core/bal_camera.h"
#include "core/random.h"
#include "estimator/factors/bal_factors.h"
#include "factor_subject.h"
#include "plain_bal.h"

namespace plumbline::testing {

inline const core::RandomStream kBalRandom({31, 0}, "bal_factors_test");
inline const estimator::BalLeftCameraManifold kBalLeftManifold;

enum class BalForm { kAdditive, kLeft };

inline FactorScene bal_scene(BalForm form, const core::BalCamera& camera, const Eigen::Vector3d& X,
                             const Eigen::Vector2d& pixel, core::ViewAxis axis) {
  const double s = axis == core::ViewAxis::kMinusZ ? -1.0 : 1.0;
  FactorScene scene;
  if (form == BalForm::kAdditive) {
    scene.factor = std::make_unique<estimator::BalFactor>(pixel, axis);
    scene.reference = automatic<PlainBal, 2, estimator::kBalCameraSize, 3>({pixel, s});
    scene.blocks = {block(estimator::pack(camera)), block(X)};
  } else {
    scene.factor = std::make_unique<estimator::BalLeftFactor>(pixel, axis);
    scene.reference = automatic<PlainBalLeft, 2, estimator::kBalLeftCameraSize, 3>({{pixel, s}});
    scene.blocks = {block(estimator::pack_left(camera), &kBalLeftManifold), block(X)};
  }
  return scene;
}

// A camera anywhere that looks at X from 2 to 6 m, X up to 25 degrees off its axis; every second one looks along +z.
inline FactorScene random_bal_scene(BalForm form, const SceneRequest& request) {
  const std::uint64_t i = request.scene;
  const core::ViewAxis axis = i % 2 == 0 ? core::ViewAxis::kMinusZ : core::ViewAxis::kPlusZ;
  core::BalCamera camera{.w = kBalRandom.normal3(i, 0),
                         .t = {},
                         .intrinsics = {500.0 + 50.0 * kBalRandom.normal(i, 1), -0.1 * kBalRandom.uniform(i, 2),
                                        0.05 * kBalRandom.uniform(i, 3)}};
  Eigen::Vector3d X = kBalRandom.normal3(i, 4);
  const double z = (axis == core::ViewAxis::kMinusZ ? -1.0 : 1.0) * (2.0 + 4.0 * kBalRandom.uniform(i, 5));
  const Eigen::Vector3d P_C(0.2 * z * kBalRandom.normal(i, 6), 0.2 * z * kBalRandom.normal(i, 7), z);
  camera.t = P_C - core::exp_so3(camera.w) * X;
  Eigen::Vector2d pixel = core::project_bal(camera.intrinsics, axis, P_C).value();
  pixel += request.noise * kBalRandom.normal2(1000 + request.draw, i);
  if (request.off_truth) {
    camera.w += 0.02 * kBalRandom.normal3(i, 8);
    camera.t += 0.05 * kBalRandom.normal3(i, 9);
    camera.intrinsics.k1 += 0.02;
    X += 0.05 * kBalRandom.normal3(i, 10);
  }
  // World to camera: R' = R R_new^T, t' = t - R' p_new.
  const Eigen::Quaterniond q = core::exp_quaternion(camera.w) * request.T_new_W.q.conjugate();
  camera.w = core::log_so3(q);
  camera.t -= q * request.T_new_W.p;
  return bal_scene(form, camera, request.T_new_W * X, pixel, axis);
}

inline std::vector<FactorScene> bal_limits(BalForm form) {
  const core::BalIntrinsics lens{500.0, -0.1, 0.05};
  const Eigen::Vector2d pixel(1.0, -2.0);
  std::vector<FactorScene> scenes;
  const auto add = [&](const core::BalCamera& camera, const Eigen::Vector3d& X) {
    scenes.push_back(bal_scene(form, camera, X, pixel, core::ViewAxis::kMinusZ));
  };
  const Eigen::Vector3d X(0.3, -0.2, -4.0);
  add({.intrinsics = lens}, X);                                               // no rotation
  add({.w = {1e-9, -2e-9, 1e-9}, .intrinsics = lens}, X);                     // hardly any
  add({.w = {0.02, 0.02, 0.015}, .intrinsics = lens}, X);                     // where the series take over
  add({.w = {0.0, 0.0, 3.14159265}, .intrinsics = lens}, X);                  // half a turn
  add({.w = {0.0, 4.0, 0.0}, .t = {0.0, 0.0, -9.0}, .intrinsics = lens}, X);  // more
  add({.intrinsics = lens}, {0.0, 0.0, -4.0});                                // on the axis
  add({.intrinsics = lens}, {300.0, -200.0, -1e6});                           // far
  add({.intrinsics = lens}, {1e-4, -1e-4, -1e-3});                            // near
  add({.intrinsics = lens}, {0.3, -0.2, 4.0});                                // behind
  return scenes;
}

inline std::vector<FactorSubject> bal_subjects() {
  std::vector<FactorSubject> list;
  for (const BalForm form : {BalForm::kAdditive, BalForm::kLeft}) {
    list.push_back({.name = form == BalForm::kAdditive ? "Additive" : "Left",
                    .scene = [form](const SceneRequest& r) { return random_bal_scene(form, r); },
                    .limits = [form] { return bal_limits(form); }});
  }
  return list;
}

}  // namespace plumbline::testing
