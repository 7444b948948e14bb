// Bundle adjustment: known truth, statistics of the cost, the published problem.
#include "estimator/bundle_adjustment.h"

#include <cmath>
#include <filesystem>

#include <gtest/gtest.h>

#include "data_folder.h"
#include "eval/alignment.h"
#include "sim/bal_world.h"

namespace plumbline::estimator {
namespace {

constexpr double kTight = 1e-14;  // of the cost: well past what the tests ask for

// The root mean square distance of cameras and points from the truth after Sim3 alignment, metres.
double error_after_alignment(const core::BalProblem& estimate, const core::BalProblem& truth) {
  std::vector<Eigen::Vector3d> a = estimate.points;
  std::vector<Eigen::Vector3d> b = truth.points;
  for (const core::BalCamera& c : estimate.cameras) a.push_back(c.centre());
  for (const core::BalCamera& c : truth.cameras) b.push_back(c.centre());
  const eval::AlignmentResult alignment = eval::align(a, b, eval::Alignment::kSim3);
  EXPECT_TRUE(alignment.ok) << alignment.reason;
  double sum = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += (alignment.truth_from_estimate * a[i] - b[i]).squaredNorm();
  return std::sqrt(sum / static_cast<double>(a.size()));
}

TEST(BundleAdjustment, NoiseFreeFindsTheTruth) {
  const sim::BalSimulation s = sim::simulate_bal({.cameras = 8, .points = 100, .pixel_sigma_px = 0.0}, {1, 0});
  EXPECT_GT(error_after_alignment(s.problem, s.truth), 0.05);
  for (const BundleRotation rotation : {BundleRotation::kAngleAxis, BundleRotation::kLeft}) {
    const BundleResult result =
        adjust_bundle(s.problem, {.rotation = rotation, .max_iterations = 100, .function_tolerance = kTight});
    EXPECT_LT(result.rmse_px, 1e-6);
    // 1e-6 px at f = 800 px and 6 m are 1e-8 m; weak directions (distortion against depth) are 100 times worse.
    EXPECT_LT(error_after_alignment(result.problem, s.truth), 1e-6);
    for (std::size_t i = 0; i < s.truth.cameras.size(); ++i) {
      EXPECT_NEAR(result.problem.cameras[i].intrinsics.f_px, s.truth.cameras[i].intrinsics.f_px, 1e-3);
      EXPECT_NEAR(result.problem.cameras[i].intrinsics.k1, s.truth.cameras[i].intrinsics.k1, 1e-6);
    }
    EXPECT_EQ(result.behind, 0);
  }
}

// With white noise of sigma px, 2 cost/sigma^2 is chi-squared with observations - parameters + gauge degrees of
// freedom.
TEST(BundleAdjustment, CostIsChiSquared) {
  const sim::BalWorldConfig config{.cameras = 10, .points = 300, .pixel_sigma_px = 0.7};
  const sim::BalSimulation s = sim::simulate_bal(config, {2, 0});
  const BundleResult result = adjust_bundle(s.problem, {.function_tolerance = 1e-10});
  ASSERT_EQ(result.status, core::SolveStatus::kConverged) << result.reason;
  const double dof = 2.0 * static_cast<double>(s.problem.observations.size()) - 9.0 * 10.0 -
                     3.0 * static_cast<double>(s.problem.points.size()) + 7.0;
  const double chi2 = 2.0 * result.final_cost / (0.7 * 0.7);
  EXPECT_NEAR(chi2, dof, 3.3 * std::sqrt(2.0 * dof));  // 99.9 %
  EXPECT_LT(error_after_alignment(result.problem, s.truth), 0.01);
  EXPECT_NEAR(result.rmse_px, std::sqrt(2.0 * result.final_cost / static_cast<double>(s.problem.observations.size())),
              1e-12);
}

TEST(BundleAdjustment, FormsAndSolversAgree) {
  const sim::BalSimulation s = sim::simulate_bal({.cameras = 8, .points = 100}, {3, 0});
  const double cost = adjust_bundle(s.problem, {.function_tolerance = 1e-12}).final_cost;
  for (const BundleSolver solver :
       {BundleSolver::kDenseSchur, BundleSolver::kSparseSchur, BundleSolver::kIterativeSchur}) {
    for (const BundleRotation rotation : {BundleRotation::kAngleAxis, BundleRotation::kLeft}) {
      const BundleResult result = adjust_bundle(
          s.problem, {.solver = solver, .rotation = rotation, .max_iterations = 200, .function_tolerance = 1e-12});
      EXPECT_EQ(result.status, core::SolveStatus::kConverged) << result.reason;
      EXPECT_EQ(result.solver, solver);
      // Conjugate gradients end early, so that the last of the cost goes slowly.
      EXPECT_NEAR(result.final_cost / cost, 1.0, solver == BundleSolver::kIterativeSchur ? 1e-6 : 1e-9);
    }
  }
}

TEST(BundleAdjustment, SimulatedWorldIsSeenAndRepeats) {
  const sim::BalWorldConfig config;
  const sim::BalSimulation s = sim::simulate_bal(config, {4, 0});
  EXPECT_EQ(s.truth.cameras.size(), 20U);
  EXPECT_GT(s.truth.points.size(), 900U);
  const sim::BalSimulation same = sim::simulate_bal(config, {4, 0});
  const sim::BalSimulation other = sim::simulate_bal(config, {4, 1});
  EXPECT_EQ(same.problem.points, s.problem.points);
  EXPECT_EQ(other.truth.points, s.truth.points);  // another trial, the same world
  EXPECT_NE(other.problem.points, s.problem.points);
  double sum2 = 0.0;
  for (std::size_t i = 0; i < s.truth.observations.size(); ++i) {
    sum2 += (s.problem.observations[i].pixel - s.truth.observations[i].pixel).squaredNorm();
  }
  const double n = 2.0 * static_cast<double>(s.truth.observations.size());
  EXPECT_NEAR(sum2 / n / 0.25, 1.0, 3.3 * std::sqrt(2.0 / n));  // 99.9 %
}

TEST(BundleAdjustment, UnobservedCamerasAndPointsStay) {
  sim::BalSimulation s = sim::simulate_bal({.cameras = 8, .points = 60}, {5, 0});
  s.problem.points.emplace_back(1.0, 2.0, 3.0);
  s.problem.cameras.push_back({.t = {4.0, 5.0, 6.0}});
  const BundleResult result = adjust_bundle(s.problem, {});
  EXPECT_EQ(result.status, core::SolveStatus::kConverged) << result.reason;
  EXPECT_EQ(result.problem.points.back(), Eigen::Vector3d(1.0, 2.0, 3.0));
  EXPECT_EQ(result.problem.cameras.back().t, Eigen::Vector3d(4.0, 5.0, 6.0));
}

TEST(BundleAdjustment, APointInTheCamerasPlaneIsAnOutcome) {
  sim::BalSimulation s = sim::simulate_bal({.cameras = 8, .points = 60}, {6, 0});
  s.problem.points[0] = s.problem.cameras[static_cast<std::size_t>(s.problem.observations[0].camera)].centre();
  s.problem.cameras[0].w.setZero();  // so that the difference is exactly zero
  s.problem.cameras[0].t.setZero();
  s.problem.points[0].setZero();
  s.problem.observations[0] = {0, 0, {1.0, 2.0}};
  const BundleResult result = adjust_bundle(s.problem, {});
  EXPECT_EQ(result.status, core::SolveStatus::kFailedInitialisation);
  EXPECT_FALSE(result.reason.empty());
  EXPECT_TRUE(std::isnan(result.final_cost));
}

// 16 cameras and 22,106 points of Dubrovnik. The figures are those of Ceres' own example with automatic derivatives.
TEST(BundleAdjustment, PublishedProblem) {
  const std::filesystem::path file = data_folder() / "bal/problem-16-22106-pre.txt";
  if (!std::filesystem::exists(file)) GTEST_SKIP() << file << " is absent (PLUMBLINE_DATA)";
  const core::BalProblem problem = core::read_bal(file);
  EXPECT_EQ(problem.cameras.size(), 16U);
  EXPECT_EQ(problem.points.size(), 22106U);
  EXPECT_EQ(problem.observations.size(), 83718U);
  for (const BundleRotation rotation : {BundleRotation::kAngleAxis, BundleRotation::kLeft}) {
    const BundleResult result = adjust_bundle(problem, {.solver = BundleSolver::kDenseSchur, .rotation = rotation});
    EXPECT_EQ(result.status, core::SolveStatus::kConverged);
    EXPECT_NEAR(result.initial_cost, 4.185660e+06, 0.5);  // all printed digits
    EXPECT_NEAR(result.final_cost, 1.803390e+04, 0.01);
    EXPECT_EQ(result.iterations, 7);
    EXPECT_EQ(result.behind, 0);
  }
}

}  // namespace
}  // namespace plumbline::estimator
