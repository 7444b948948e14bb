// The line factors, without and with a lens, as subjects of the laws.
#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "core/random.h"
#include "estimator/factors/line_factors.h"
#include "estimator/factors/local_motion.h"
#include "factor_subject.h"
#include "line_scene.h"
#include "plain_lines.h"
#include "rig_blocks.h"

namespace plumbline::testing {

inline const core::RandomStream kLineRandom({41, 0}, "line_factors_test");
inline const estimator::OrthonormalLineManifold kLineManifold;

// About the moved origin: only directions turn.
inline void move_line(const core::Pose& T_new_W, Block& b) {
  const Eigen::Quaterniond U = T_new_W.q * Eigen::Map<const Eigen::Quaterniond>(b.values.data());
  std::copy(U.coeffs().data(), U.coeffs().data() + 4, b.values.begin());
}

inline estimator::SegmentPixels noisy_segment(estimator::SegmentPixels pixels, const SceneRequest& request) {
  for (std::uint64_t k = 0; k < 2; ++k) {
    pixels[k] += request.noise * kLineSigmaPx * kLineRandom.normal2(1000 + request.draw, 10 * request.scene + k);
  }
  return pixels;
}

inline void displace_line_blocks(std::vector<Block>& blocks, const std::vector<double>& scales, std::uint64_t scene) {
  for (std::size_t k = 0; k < blocks.size(); ++k) displace(blocks[k], scales[k], kLineRandom, 500 + scene, k);
}

inline FactorScene camera_line_scene(const LineView& v, const SceneRequest& request) {
  const estimator::CameraModel model = line_model(v);
  const Eigen::Vector3d origin = request.T_new_W * v.origin_W;
  const estimator::SegmentPixels pixels = noisy_segment(v.pixels, request);
  FactorScene s{std::make_unique<estimator::CameraLineFactor>(model, origin, pixels),
                automatic<PlainCameraLine, 2, estimator::kPoseSize, estimator::kLineSize>(
                    {{model.camera, model.pixel_sigma_px, pixels}, origin}),
                {pose_block(v.state.T_W_B * v.rig.T_B_C), block(v.line, &kLineManifold)}};
  if (request.off_truth) displace_line_blocks(s.blocks, {0.02, 0.02}, request.scene);
  s.blocks[0].values = pose_block(request.T_new_W * estimator::unpack_pose(s.blocks[0].values.data())).values;
  move_line(request.T_new_W, s.blocks[1]);
  return s;
}

inline std::vector<Block> rig_line_blocks(const LineView& v, const SceneRequest& request) {
  std::vector<Block> blocks = {state_block(v.state), pose_block(v.rig.T_B_C), scalar_block(v.rig.td_s),
                               scalar_block(v.rig.readout_s), block(v.line, &kLineManifold)};
  if (request.off_truth) displace_line_blocks(blocks, {0.02, 0.01, 0.002, 0.003, 0.02}, request.scene);
  move_state(request.T_new_W, blocks[0]);
  move_line(request.T_new_W, blocks[4]);
  return blocks;
}

inline FactorScene velocity_line_scene(const LineView& v, const SceneRequest& request) {
  const estimator::CameraModel model = line_model(v);
  const Eigen::Vector3d origin = request.T_new_W * v.origin_W;
  const estimator::SegmentPixels pixels = noisy_segment(v.pixels, request);
  return {std::make_unique<estimator::VelocityLineFactor>(model, origin, pixels, v.velocities, v.td_k_s),
          automatic<PlainVelocityLine, 2, estimator::kStateSize, estimator::kPoseSize, 1, 1, estimator::kLineSize>(
              {{model.camera, model.pixel_sigma_px, pixels}, origin, v.velocities, v.td_k_s}),
          rig_line_blocks(v, request)};
}

inline FactorScene propagated_line_scene(const LineView& v, const SceneRequest& request) {
  const estimator::CameraModel model = line_model(v);
  const Eigen::Vector3d origin = request.T_new_W * v.origin_W;
  const estimator::SegmentPixels pixels = noisy_segment(v.pixels, request);
  std::vector<Block> blocks = rig_line_blocks(v, request);
  // The samples lie in step with small differences of td and readout only as long as no sample is crossed.
  blocks[2].ridders_step = blocks[3].ridders_step = 2e-5;
  blocks[0].ridders_step = blocks[1].ridders_step = 3e-4;
  // Propagation is linear in the biases about those of the table: the state's own, where both are the same.
  const core::ImuBias bias = estimator::unpack_state(blocks[0].values.data()).bias;
  const auto motion = std::make_shared<estimator::LocalMotion>(*v.samples, v.state_index, 0.1, bias);
  return {std::make_unique<estimator::PropagatedLineFactor>(model, estimator::FrameTiming{motion, v.offset_s}, origin,
                                                            pixels),
          automatic<PlainPropagatedLine, 2, estimator::kStateSize, estimator::kPoseSize, 1, 1, estimator::kLineSize>(
              {{model.camera, model.pixel_sigma_px, pixels},
               origin,
               {v.samples, v.state_index, v.offset_s, model.gravity_m_s2}}),
          std::move(blocks)};
}

using LineScene = FactorScene (*)(const LineView&, const SceneRequest&);

// A line that passes its own origin at 1 mm (w1 small), one 500 m away, and a global shutter.
inline std::vector<FactorScene> line_limits(LineScene scene, const LineView& base) {
  const core::Pose T_W_C = base.state.T_W_B * base.rig.T_B_C;
  const auto view = [&](const Eigen::Vector3d& C, const Eigen::Vector3d& D, const Eigen::Vector3d& origin_W) {
    LineView v = base;
    v.origin_W = origin_W;
    v.line = line_block(T_W_C * C, T_W_C * D, origin_W).value();
    return v;
  };
  const LineView near = view({-0.3, 0.1, 2.0}, {0.4, 0.2, 2.5}, T_W_C * Eigen::Vector3d(-0.3, 0.1, 2.001));
  const LineView far = view({-80.0, 20.0, 500.0}, {100.0, 40.0, 500.0}, base.origin_W);
  LineView global = base;
  global.rig.readout_s = 0.0;
  LineView negative = base;
  negative.rig.readout_s = -0.001;
  std::vector<FactorScene> scenes;
  for (const LineView& v : {near, far, global, negative}) scenes.push_back(scene(v, SceneRequest{}));
  return scenes;
}

inline std::vector<FactorSubject> line_subjects() {
  std::vector<FactorSubject> result;
  for (const core::DistortionModel lens : {core::DistortionModel::kNone, core::DistortionModel::kEquidistant}) {
    const std::string suffix = lens == core::DistortionModel::kNone ? "" : "Equidistant";
    const auto still = [lens](std::uint64_t i) { return still_line(i, lens); };
    const auto sliding = [lens](std::uint64_t i) { return sliding_line(i, lens); };
    const auto moving = [lens](std::uint64_t i) { return handheld_line(i, 0.03, 0.008, lens); };
    result.push_back({.name = "Camera" + suffix,
                      .scene = [still](const SceneRequest& r) { return camera_line_scene(still(r.scene), r); },
                      .limits = [still] { return line_limits(camera_line_scene, still(0)); }});
    // The model neglects that the row's noise moves the observation in time: flow * readout/rows, 1 %.
    result.push_back({.name = "FeatureVelocity" + suffix,
                      .scene = [sliding](const SceneRequest& r) { return velocity_line_scene(sliding(r.scene), r); },
                      .limits = [sliding] { return line_limits(velocity_line_scene, sliding(0)); },
                      .whitening_slack = 0.02});
    // At the truth what is left is the integration over the gap, 1e-6 m.
    result.push_back({.name = "Propagated" + suffix,
                      .scene = [moving](const SceneRequest& r) { return propagated_line_scene(moving(r.scene), r); },
                      .limits = [moving] { return line_limits(propagated_line_scene, moving(0)); },
                      .zero_tolerance = 1e-3});
  }
  return result;
}

}  // namespace plumbline::testing
