// Google Benchmark of the parts that a trial spends its time in: build/<preset>/tools/plumbline_benchmarks
#include <array>
#include <ctime>
#include <filesystem>
#include <functional>
#include <numeric>

#include <benchmark/benchmark.h>

#include "core/dataset.h"
#include "estimator/estimate.h"
#include "estimator/factors/preintegration.h"
#include "estimator/keyframes.h"
#include "estimator/window.h"
#include "eval/cramer_rao.h"
#include "sim/simulate.h"
#include "sim/truth_files.h"

namespace plumbline {
namespace {

// The setting of configs/scenarios/handheld_rs.yaml.
sim::ScenarioConfig handheld_rs() {
  sim::ScenarioConfig c;
  c.trajectory.handheld.rate_rms_rad_s = 0.75;
  c.imu.noise = {1.7e-4, 2e-5, 2e-3, 3e-3};
  c.camera.td_s = 0.02;
  c.camera.readout_s = 0.03;
  c.prior.td_sigma_s = 0.02;
  return c;
}

void simulate_scenario(benchmark::State& state, const sim::ScenarioConfig& config,
                       const std::function<void(const sim::Simulation&)>& use = {}) {
  std::uint64_t trial = 0;
  std::size_t points = 0;
  std::size_t lines = 0;
  std::size_t frames = 0;
  for ([[maybe_unused]] auto _ : state) {
    const sim::Simulation s = sim::simulate(config, {1, trial++});
    for (const core::Frame& frame : s.measurements.frames) {
      points += frame.points.size();
      lines += frame.lines.size();
    }
    frames += s.measurements.frames.size();
    if (use) use(s);
  }
  state.counters["times_real_time"] =
      benchmark::Counter(config.duration_s * static_cast<double>(state.iterations()), benchmark::Counter::kIsRate);
  state.counters["points_a_frame"] = static_cast<double>(points) / static_cast<double>(frames);
  state.counters["lines_a_frame"] = static_cast<double>(lines) / static_cast<double>(frames);
}

void simulate(benchmark::State& state) { simulate_scenario(state, handheld_rs()); }
BENCHMARK(simulate)->Unit(benchmark::kMillisecond);

// 60 s with every defect of both sensors and a lens.
sim::ScenarioConfig everything_on() {
  sim::ScenarioConfig c = handheld_rs();
  c.duration_s = 60.0;
  for (sim::TriadDefects* triad : {&c.imu.gyro, &c.imu.accel}) {
    triad->scale_error.setConstant(0.003);
    triad->misalignment_rad.setConstant(0.002);
    triad->noise_factor.setConstant(1.5);
    triad->quantisation = 1e-3;
    triad->saturation = 30.0;
  }
  c.imu.g_sensitivity.setConstant(1e-4);
  c.imu.stamp_jitter_s = 1e-4;
  c.imu.dropout_probability = 0.002;
  c.camera.model.distortion = {core::DistortionModel::kRadtan, {-0.283, 0.074, 2e-4, 2e-5}};
  c.camera.exposure_s = 0.008;
  c.camera.exposure_stamp = sim::ExposureStamp::kStart;
  c.camera.trigger_jitter_s = 5e-4;
  c.camera.stamp_jitter_s = 1e-4;
  c.camera.drop_probability = 0.02;
  c.camera.pixel_noise_dof = 5.0;
  c.camera.pixel_noise_correlation = 0.5;
  c.camera.gross_outlier_probability = 0.01;
  c.camera.uniform_outlier_probability = 0.01;
  c.points.loss_probability = 0.02;
  return c;
}

void simulate_with_all_defects(benchmark::State& state) { simulate_scenario(state, everything_on()); }
BENCHMARK(simulate_with_all_defects)->Unit(benchmark::kMillisecond);

// 100 points and 40 lines a frame in rooms whose walls hide what is behind them.
sim::ScenarioConfig line_rooms() {
  sim::ScenarioConfig c = handheld_rs();
  c.duration_s = 60.0;
  c.trajectory.type = sim::TrajectoryType::kFigureEight;
  c.trajectory.loop.radius_m = 5.0;
  c.trajectory.loop.period_s = 22.0;
  c.world.type = sim::WorldType::kRooms;
  c.world.landmarks = 6000;
  c.world.lines.windows.spacing_m = 2.0;
  c.world.lines.random = 800;
  c.lines.per_frame = 42;  // 40 on average: some frames see fewer
  c.lines.slide_sigma_px = 3.0;
  c.lines.fragment_probability = 0.01;
  c.lines.merge_probability = 0.1;
  c.lines.loss_probability = 0.02;
  return c;
}

void simulate_lines(benchmark::State& state) { simulate_scenario(state, line_rooms()); }
BENCHMARK(simulate_lines)->Unit(benchmark::kMillisecond);

void simulate_and_write_lines(benchmark::State& state) {
  const std::filesystem::path folder = std::filesystem::temp_directory_path() / "plumbline_benchmark_lines";
  std::filesystem::remove_all(folder);
  simulate_scenario(state, line_rooms(), [&](const sim::Simulation& s) {
    core::write_dataset(folder, s.measurements, {});
    sim::write_truth(folder, s.truth);
    state.PauseTiming();
    std::filesystem::remove_all(folder);
    state.ResumeTiming();
  });
}
BENCHMARK(simulate_and_write_lines)->Unit(benchmark::kMillisecond);

estimator::Solver solver_of(const benchmark::State& state) {
  return state.range(0) != 0 ? estimator::Solver::kCeres : estimator::Solver::kSchur;
}

// 15 s at 10 Hz.
void batch_solve(benchmark::State& state, estimator::TimingModel timing) {
  const sim::Simulation s = sim::simulate(handheld_rs(), {1, 0});
  estimator::EstimatorConfig config;
  config.timing = timing;
  config.solver = solver_of(state);
  int observations = 0;
  for ([[maybe_unused]] auto _ : state) observations = estimator::estimate(s.measurements, config).summary.observations;
  state.counters["observations"] = observations;
}
void with_both_solvers(benchmark::internal::Benchmark* b) {
  b->ArgName("ceres")->Arg(0)->Arg(1)->Unit(benchmark::kSecond)->Iterations(3);
}
BENCHMARK_CAPTURE(batch_solve, propagated, estimator::TimingModel::kPropagated)->Apply(with_both_solvers);
BENCHMARK_CAPTURE(batch_solve, spline, estimator::TimingModel::kSpline)->Apply(with_both_solvers);

// A window of 10 keyframes and 40 kept points that moves over the same 15 s: what a keyframe takes, and in which parts.
void window(benchmark::State& state) {
  const sim::Simulation s = sim::simulate(handheld_rs(), {1, 0});
  estimator::EstimatorConfig config;
  config.type = estimator::EstimatorType::kSlidingWindow;
  config.solver = solver_of(state);
  enum Part { kAdd, kTriangulate, kSolve, kAssess, kFold, kParts };
  std::array<double, kParts> spent_s = {};
  int keyframes = 0;
  int systems = 0;
  for ([[maybe_unused]] auto _ : state) {
    estimator::Window window(s.measurements, config);
    const auto timed = [&](Part part, const auto& work) {
      const std::clock_t begin = std::clock();
      work();
      spent_s[part] += static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
    };
    for (const std::size_t frame : estimator::select_keyframes(s.measurements.frames, 10.0)) {
      timed(kAdd, [&] { window.add_frame(frame); });
      timed(kTriangulate, [&] { window.triangulate(); });
      timed(kSolve, [&] { systems += window.solve().result.iterations; });
      timed(kAssess, [&] { window.assess(true); });
      timed(kFold, [&] {
        while (window.size() > static_cast<std::size_t>(config.window.keyframes)) window.fold_oldest();
      });
      ++keyframes;
    }
  }
  const auto each_ms = [&](double total_s) { return 1e3 * total_s / keyframes; };
  state.counters["keyframe_ms"] = each_ms(std::accumulate(spent_s.begin(), spent_s.end(), 0.0));
  state.counters["add_ms"] = each_ms(spent_s[kAdd]);  // with tracks, preintegration, tables of the motion at a frame
  state.counters["triangulate_ms"] = each_ms(spent_s[kTriangulate]);
  state.counters["solve_ms"] = each_ms(spent_s[kSolve]);
  state.counters["assess_ms"] = each_ms(spent_s[kAssess]);
  state.counters["marginalise_ms"] = each_ms(spent_s[kFold]);
  state.counters["systems"] = static_cast<double>(systems) / keyframes;
}
BENCHMARK(window)->ArgName("ceres")->Arg(0)->Arg(1)->Unit(benchmark::kSecond)->Iterations(3);

// The Cramer-Rao bound of the same problem, without and with that of every instant.
void bound(benchmark::State& state) {
  const sim::Simulation s = sim::simulate(handheld_rs(), {1, 0});
  const eval::BoundOptions options{.frames = estimator::select_keyframes(s.measurements.frames, 10.0),
                                   .causal = state.range(0) != 0};
  for ([[maybe_unused]] auto _ : state) {
    benchmark::DoNotOptimize(eval::cramer_rao_bound(s.measurements, s.truth, options));
  }
}
BENCHMARK(bound)->ArgName("causal")->Arg(0)->Arg(1)->Unit(benchmark::kSecond);

void preintegrate_20_samples(benchmark::State& state) {
  const sim::Simulation s = sim::simulate(handheld_rs(), {1, 0});
  const std::span<const core::ImuSample> samples(s.measurements.imu.data(), 21);
  for ([[maybe_unused]] auto _ : state) {
    benchmark::DoNotOptimize(estimator::preintegrate(samples, {}, s.measurements.imu_noise));
  }
}
BENCHMARK(preintegrate_20_samples);

}  // namespace
}  // namespace plumbline

BENCHMARK_MAIN();
