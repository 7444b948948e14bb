// Google Benchmark of the factors, with all Jacobians: analytic against automatic differentiation of the plain formula.
//   build/<preset>/tests/factor_benchmarks [--benchmark_filter=Pinhole]
#include <benchmark/benchmark.h>

#include "point_subjects.h"

namespace plumbline::testing {
namespace {

void evaluate_with_jacobians(benchmark::State& state, const ceres::CostFunction& factor,
                             const std::vector<Block>& blocks) {
  Eigen::VectorXd residual(factor.num_residuals());
  std::vector<std::vector<double>> values;
  for (const Block& b : blocks) values.emplace_back(static_cast<std::size_t>(residual.size()) * b.values.size());
  std::vector<double*> jacobians;
  for (std::vector<double>& v : values) jacobians.push_back(v.data());
  const std::vector<const double*> parameters = pointers(blocks);
  for ([[maybe_unused]] auto _ : state) {
    if (!factor.Evaluate(parameters.data(), residual.data(), jacobians.data())) state.SkipWithError("no value");
    benchmark::DoNotOptimize(values);
  }
}

void add(const FactorSubject& subject) {
  const auto scene = std::make_shared<FactorScene>(subject.scene({.scene = 1, .noise = 1.0, .off_truth = true}));
  benchmark::RegisterBenchmark((subject.name + "/analytic").c_str(), [scene](benchmark::State& state) {
    evaluate_with_jacobians(state, *scene->factor, scene->blocks);
  });
  benchmark::RegisterBenchmark((subject.name + "/automatic").c_str(), [scene](benchmark::State& state) {
    evaluate_with_jacobians(state, *scene->reference, scene->blocks);
  });
}

}  // namespace
}  // namespace plumbline::testing

int main(int argc, char** argv) {
  for (const auto& subject : plumbline::testing::point_subjects()) plumbline::testing::add(subject);
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
