// The priors as subjects of the laws.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <numbers>
#include <vector>

#include "core/random.h"
#include "core/state.h"
#include "estimator/factors/prior_factors.h"
#include "factor_subject.h"
#include "plain_factors.h"
#include "rig_blocks.h"

namespace plumbline::testing {

inline const core::StateSigmas kStateSigmas{0.01, 0.02, 0.05, 0.005, 0.1};

inline FactorScene state_prior(const core::State& mean, const core::State& state) {
  return {std::make_unique<estimator::StatePriorFactor>(mean, kStateSigmas),
          automatic<PlainStatePrior, core::kStateDof, estimator::kStateSize>({mean, kStateSigmas.per_axis()}),
          {state_block(state, 0.01)}};
}

// A mean that is drawn about the truth.
inline FactorScene state_prior_scene(const SceneRequest& request) {
  const core::State truth = moved_state(request.T_new_W, random_state(request.scene));
  core::StateTangent n;
  for (std::uint64_t i = 0; i < 5; ++i) {
    n.segment<3>(3 * static_cast<int>(i)) = request.noise * kStateRandom.normal3(4000 + request.draw, i);
  }
  // The noise of a position is of the world's axes, so that it turns with them.
  n.head<3>() = request.T_new_W.q * n.head<3>();
  n.segment<3>(core::kVelocity) = request.T_new_W.q * n.segment<3>(core::kVelocity);
  return state_prior(core::plus(truth, n.cwiseProduct(kStateSigmas.per_axis())), truth);
}

inline FactorScene extrinsics_prior(const core::Pose& mean, const core::Pose& T_B_C) {
  return {std::make_unique<estimator::ExtrinsicsPriorFactor>(mean, 0.02, 0.3),
          automatic<PlainExtrinsicsPrior, 6, estimator::kPoseSize>({mean, 0.02, 0.3}),
          {pose_block(T_B_C, 0.01)}};
}

inline FactorScene extrinsics_prior_scene(const SceneRequest& request) {
  const core::Pose truth = random_state(request.scene).T_W_B;
  const auto n = [&](std::uint64_t sub) -> Eigen::Vector3d {
    return request.noise * kStateRandom.normal3(5000 + request.draw, sub);
  };
  return extrinsics_prior({truth.q * core::exp_quaternion(0.3 * n(0)), truth.p + 0.02 * n(1)}, truth);
}

inline FactorScene scalar_prior_scene(const SceneRequest& request) {
  const double truth = 0.01 * static_cast<double>(request.scene);
  const double mean = truth + 0.005 * request.noise * kStateRandom.normal(6000 + request.draw);
  return {std::make_unique<estimator::ScalarPriorFactor>(mean, 0.005),
          automatic<PlainScalarPrior, 1, 1>({mean, 0.005}),
          {scalar_block(truth, 0.01)}};
}

inline FactorScene intrinsics_prior_scene(const SceneRequest& request) {
  const core::Intrinsics truth(460.0, 455.0 + static_cast<double>(request.scene), 320.0, 240.0);
  const auto n = kStateRandom.normals(7000 + request.draw);
  const core::Intrinsics sigma(4.0, 4.0, 3.0, 3.0);
  const core::Intrinsics mean = truth + request.noise * core::Intrinsics(n[0], n[1], n[2], n[3]).cwiseProduct(sigma);
  return {std::make_unique<estimator::IntrinsicsPriorFactor>(mean, 4.0, 3.0),
          automatic<PlainIntrinsicsPrior, 4, 4>({mean, sigma}),
          {block(truth, nullptr, 0.1)}};
}

// Angles between a mean and what is estimated: none, where the series begin and end, and nearly half a turn, where the
// rotation vector is about to change its side.
inline constexpr double kPriorAngles[] = {0.0, 1e-9, 0.03, 0.04, std::numbers::pi - 1e-3, std::numbers::pi - 1e-9};

inline std::vector<FactorScene> state_prior_limits() {
  std::vector<FactorScene> limits;
  for (const double angle : kPriorAngles) {
    const core::State mean = random_state(2);
    core::StateTangent d = core::StateTangent::Zero();
    d.segment<3>(core::kOrientation) = angle * Eigen::Vector3d(2.0, -1.0, 2.0) / 3.0;
    limits.push_back(state_prior(mean, core::plus(mean, d)));
  }
  return limits;
}

inline std::vector<FactorScene> extrinsics_prior_limits() {
  std::vector<FactorScene> limits;
  for (const double angle : kPriorAngles) {
    const core::Pose mean = random_state(3).T_W_B;
    const Eigen::Vector3d theta = angle * Eigen::Vector3d(1.0, 2.0, -2.0) / 3.0;
    limits.push_back(extrinsics_prior(mean, {mean.q * core::exp_quaternion(theta), mean.p}));
  }
  return limits;
}

inline std::vector<FactorScene> scalar_prior_limits() {
  std::vector<FactorScene> limits;
  limits.push_back(scalar_prior_scene(SceneRequest{.scene = 1}));
  return limits;
}

inline std::vector<FactorScene> intrinsics_prior_limits() {
  std::vector<FactorScene> limits;
  limits.push_back(intrinsics_prior_scene(SceneRequest{.scene = 1}));
  return limits;
}

inline std::vector<FactorSubject> prior_subjects() {
  return {
      {.name = "StatePrior", .scene = state_prior_scene, .limits = state_prior_limits},
      {.name = "ExtrinsicsPrior",
       .scene = extrinsics_prior_scene,
       .limits = extrinsics_prior_limits,
       .in_world = false},
      {.name = "ScalarPrior", .scene = scalar_prior_scene, .limits = scalar_prior_limits, .in_world = false},
      {.name = "IntrinsicsPrior",
       .scene = intrinsics_prior_scene,
       .limits = intrinsics_prior_limits,
       .in_world = false},
  };
}

}  // namespace plumbline::testing
