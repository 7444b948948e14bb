// Google Benchmark of the parts that a trial spends its time in: build/<preset>/tools/plumbline_benchmarks
#include <benchmark/benchmark.h>

#include "estimator/estimate.h"
#include "estimator/factors/preintegration.h"
#include "sim/simulate.h"

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

void simulate(benchmark::State& state) {
  const sim::ScenarioConfig config = handheld_rs();
  std::uint64_t trial = 0;
  for (auto _ : state) benchmark::DoNotOptimize(sim::simulate(config, {1, trial++}));
  state.counters["times_real_time"] =
      benchmark::Counter(config.duration_s * static_cast<double>(state.iterations()), benchmark::Counter::kIsRate);
}
BENCHMARK(simulate)->Unit(benchmark::kMillisecond);

void batch_solve(benchmark::State& state) {
  const sim::Simulation s = sim::simulate(handheld_rs(), {1, 0});
  int observations = 0;
  for (auto _ : state) observations = estimator::estimate(s.measurements, {}).summary.observations;
  state.counters["observations"] = observations;
}
BENCHMARK(batch_solve)->Unit(benchmark::kSecond)->Iterations(3);

void preintegrate_20_samples(benchmark::State& state) {
  const sim::Simulation s = sim::simulate(handheld_rs(), {1, 0});
  const std::span<const core::ImuSample> samples(s.measurements.imu.data(), 21);
  for (auto _ : state) {
    benchmark::DoNotOptimize(estimator::preintegrate(samples, {}, s.measurements.imu_noise));
  }
}
BENCHMARK(preintegrate_20_samples);

}  // namespace
}  // namespace plumbline

BENCHMARK_MAIN();
