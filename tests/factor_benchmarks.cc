// Google Benchmark of every factor, with all Jacobians: analytic against automatic differentiation of the plain
// formula.
//   build/<preset>/tests/factor_benchmarks [--benchmark_filter=Lines]
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <benchmark/benchmark.h>

#include "bal_subjects.h"
#include "imu_subjects.h"
#include "line_subjects.h"
#include "point_subjects.h"
#include "prior_subjects.h"

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
    benchmark::ClobberMemory();
  }
}

void add(const std::string& family, const std::vector<FactorSubject>& subjects) {
  for (const FactorSubject& subject : subjects) {
    const auto scene = std::make_shared<FactorScene>(subject.scene({.scene = 1, .noise = 1.0, .off_truth = true}));
    const std::string name = family + "/" + subject.name;
    benchmark::RegisterBenchmark((name + "/analytic").c_str(), [scene](benchmark::State& state) {
      evaluate_with_jacobians(state, *scene->factor, scene->blocks);
    });
    benchmark::RegisterBenchmark((name + "/automatic").c_str(), [scene](benchmark::State& state) {
      evaluate_with_jacobians(state, *scene->reference, scene->blocks);
    });
  }
}

}  // namespace
}  // namespace plumbline::testing

int main(int argc, char** argv) {
  using namespace plumbline::testing;
  add("Points", point_subjects());
  add("Lines", line_subjects());
  add("Bal", bal_subjects());
  add("Imu", imu_subjects());
  add("Priors", prior_subjects());
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
