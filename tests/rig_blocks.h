// The parameter blocks of a rig in the scenes of the factor tests.
#pragma once

#include <cstdint>

#include "core/random.h"
#include "core/state.h"
#include "estimator/factors/parameter_blocks.h"
#include "factor_checks.h"

namespace plumbline::testing {

inline constexpr double kGravity = 9.81;
inline const estimator::StateManifold kStateManifold;
inline const estimator::PoseManifold kPoseManifold;
inline const core::RandomStream kStateRandom({7, 0}, "factors_test");

inline Block state_block(const core::State& s, double ridders_step = 1e-3) {
  return block(estimator::pack(s), &kStateManifold, ridders_step);
}
inline Block pose_block(const core::Pose& T, double ridders_step = 1e-3) {
  return block(estimator::pack(T), &kPoseManifold, ridders_step);
}

inline core::State random_state(std::uint64_t i) {
  return {.T_W_B = {core::exp_quaternion(kStateRandom.normal3(i, 0)), kStateRandom.normal3(i, 1)},
          .v_W = kStateRandom.normal3(i, 2),
          .bias = {0.02 * kStateRandom.normal3(i, 3), 0.1 * kStateRandom.normal3(i, 4)}};
}

// As seen from another world frame.
inline core::State moved_state(const core::Pose& T_new_W, core::State s) {
  s.T_W_B = T_new_W * s.T_W_B;
  s.v_W = T_new_W.q * s.v_W;
  return s;
}
inline void move_state(const core::Pose& T_new_W, Block& b) {
  b.values = state_block(moved_state(T_new_W, estimator::unpack_state(b.values.data()))).values;
}

}  // namespace plumbline::testing
