// Google Benchmark of the bundle and line factors, analytic against automatic differentiation of the plain formula; one
// evaluation with all Jacobians: build/<preset>/tests/line_benchmarks
#include <memory>
#include <vector>

#include <benchmark/benchmark.h>
#include <ceres/autodiff_cost_function.h>

#include "estimator/factors/bal_factors.h"
#include "estimator/factors/line_factors.h"
#include "line_scene.h"
#include "plain_lines.h"

namespace plumbline::estimator {
namespace {

using testing::LineView;

void evaluate(benchmark::State& state, const ceres::CostFunction& factor, std::vector<const double*> parameters) {
  std::vector<std::vector<double>> storage;
  std::vector<double*> jacobians;
  for (const int size : factor.parameter_block_sizes()) {
    storage.emplace_back(2 * static_cast<std::size_t>(size));
    jacobians.push_back(storage.back().data());
  }
  Eigen::Vector2d residual;
  for ([[maybe_unused]] auto _ : state) {
    if (!factor.Evaluate(parameters.data(), residual.data(), jacobians.data())) state.SkipWithError("no value");
    benchmark::DoNotOptimize(residual);
    benchmark::ClobberMemory();
  }
}

template <class Plain, int... kSizes>
std::unique_ptr<ceres::CostFunction> automatic(const Plain& plain) {
  return std::make_unique<ceres::AutoDiffCostFunction<Plain, 2, kSizes...>>(new Plain(plain));
}

void bal(benchmark::State& state, bool analytic, bool left) {
  const core::BalCamera camera{.w = {0.3, -0.2, 0.1}, .t = {0.1, -0.2, -5.0}, .intrinsics = {500.0, -0.1, 0.05}};
  const BalCameraBlock block = pack(camera);
  const BalLeftCameraBlock block_left = pack_left(camera);
  const Eigen::Vector3d X(1.0, 0.5, 0.25);
  const Eigen::Vector2d pixel(86.0, 24.0);
  std::unique_ptr<ceres::CostFunction> factor;
  if (left) {
    factor = std::make_unique<BalLeftFactor>(pixel);
    if (!analytic) factor = automatic<testing::PlainBalLeft, kBalLeftCameraSize, 3>({{pixel, -1.0}});
  } else {
    factor = std::make_unique<BalFactor>(pixel);
    if (!analytic) factor = automatic<testing::PlainBal, kBalCameraSize, 3>({pixel, -1.0});
  }
  evaluate(state, *factor, {left ? block_left.data() : block.data(), X.data()});
}
BENCHMARK_CAPTURE(bal, additive_analytic, true, false);
BENCHMARK_CAPTURE(bal, additive_automatic, false, false);
BENCHMARK_CAPTURE(bal, left_analytic, true, true);
BENCHMARK_CAPTURE(bal, left_automatic, false, true);

void camera_line(benchmark::State& state, bool analytic) {
  const LineView v = testing::still_line(1);
  const CameraModel model = testing::line_model(v);
  std::unique_ptr<ceres::CostFunction> factor = std::make_unique<CameraLineFactor>(model, v.origin_W, v.pixels);
  if (!analytic) {
    factor = automatic<testing::PlainCameraLine, kPoseSize, kLineSize>(
        {model.camera, model.pixel_sigma_px, v.origin_W, v.pixels});
  }
  const PoseBlock pose = pack(v.state.T_W_B * v.rig.T_B_C);
  evaluate(state, *factor, {pose.data(), v.line.data()});
}
BENCHMARK_CAPTURE(camera_line, analytic, true);
BENCHMARK_CAPTURE(camera_line, automatic, false);

void rig_line(benchmark::State& state, const LineView& v, const ceres::CostFunction& factor) {
  const StateBlock body = pack(v.state);
  const PoseBlock extrinsics = pack(v.rig.T_B_C);
  evaluate(state, factor, {body.data(), extrinsics.data(), &v.rig.td_s, &v.rig.readout_s, v.line.data()});
}

void velocity_line(benchmark::State& state, bool analytic) {
  const LineView v = testing::sliding_line(1);
  const CameraModel model = testing::line_model(v);
  std::unique_ptr<ceres::CostFunction> factor =
      std::make_unique<VelocityLineFactor>(model, v.origin_W, v.pixels, v.velocities, v.td_k_s);
  if (!analytic) {
    factor = automatic<testing::PlainVelocityLine, kStateSize, kPoseSize, 1, 1, kLineSize>(
        {model.camera, model.pixel_sigma_px, v.origin_W, v.pixels, v.velocities, v.td_k_s});
  }
  rig_line(state, v, *factor);
}
BENCHMARK_CAPTURE(velocity_line, analytic, true);
BENCHMARK_CAPTURE(velocity_line, automatic, false);

void propagated_line(benchmark::State& state, bool analytic) {
  LineView v = testing::handheld_line(1);
  for (Eigen::Vector2d& pixel : v.pixels) pixel += Eigen::Vector2d(0.4, -0.3);  // as far as noise moves it
  const CameraModel model = testing::line_model(v);
  const auto motion = std::make_shared<LocalMotion>(*v.samples, v.state_index, 0.1, v.state.bias);
  std::unique_ptr<ceres::CostFunction> factor =
      std::make_unique<PropagatedLineFactor>(model, FrameTiming{motion, v.offset_s}, v.origin_W, v.pixels);
  if (!analytic) {
    using Plain = testing::PlainPropagatedLine<testing::PlainCarriedBody>;
    factor = automatic<Plain, kStateSize, kPoseSize, 1, 1, kLineSize>(
        {model.camera, model.pixel_sigma_px, v.origin_W, v.pixels, v.offset_s,
         testing::PlainCarriedBody{v.samples, v.state_index, model.gravity_m_s2}});
  }
  rig_line(state, v, *factor);
}
BENCHMARK_CAPTURE(propagated_line, analytic, true);
BENCHMARK_CAPTURE(propagated_line, automatic, false);

}  // namespace
}  // namespace plumbline::estimator

BENCHMARK_MAIN();
