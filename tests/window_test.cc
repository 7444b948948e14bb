// The window below the online estimator: its two solvers, what leaves it, and what its prior says.
#include "estimator/window.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "core/random.h"
#include "estimator/estimate.h"
#include "estimator/invariant_chart.h"
#include "estimator/keyframes.h"
#include "estimator/schur_system.h"
#include "estimator/sliding_window.h"
#include "short_recording.h"
#include "sim/simulate.h"

namespace plumbline {
namespace {

using estimator::LeastSquares;
using estimator::LeastSquaresOptions;
using estimator::MarginalPrior;
using estimator::ParameterBlock;
using estimator::Window;

const core::RandomStream kRandom({11, 0}, "window_test");

std::vector<double> values_of(const LeastSquares& problem) {
  std::vector<double> values;
  for (const ParameterBlock& b : problem.blocks) values.insert(values.end(), b.values, b.values + b.size);
  return values;
}

void set_values(const LeastSquares& problem, const std::vector<double>& values) {
  const double* from = values.data();
  for (const ParameterBlock& b : problem.blocks) {
    std::copy_n(from, b.size, b.values);
    from += b.size;
  }
}

Eigen::VectorXd difference(const ParameterBlock& block, const double* y, const double* x) {
  Eigen::VectorXd d(block.dof);
  if (block.manifold == nullptr) {
    for (int i = 0; i < block.size; ++i) d[i] = y[i] - x[i];
  } else {
    block.manifold->Minus(y, x, d.data());
  }
  return d;
}

// Adds a step of `sigmas` standard deviations, as far as each column alone knows, to all blocks that stay.
void disturb(const LeastSquares& problem, const estimator::SchurSystem& system, double sigmas, std::uint64_t draw) {
  const Eigen::MatrixXd H = system.H();
  for (std::size_t b = 0; b < problem.blocks.size(); ++b) {
    const ParameterBlock& block = problem.blocks[b];
    if (block.eliminated || block.constant) continue;
    Eigen::VectorXd step(block.dof);
    for (int i = 0; i < block.dof; ++i) {
      const double information = H(system.column(static_cast<int>(b)) + i, system.column(static_cast<int>(b)) + i);
      step[i] = sigmas * kRandom.normal(draw, b * 16 + static_cast<std::uint64_t>(i)) / std::sqrt(information);
    }
    std::array<double, 16> moved;
    if (block.manifold == nullptr) {
      for (int i = 0; i < block.size; ++i) block.values[i] += step[i];
    } else {
      block.manifold->Plus(block.values, step.data(), moved.data());
      std::copy_n(moved.begin(), block.size, block.values);
    }
  }
}

struct Look {
  const char* name;
  sim::ScenarioConfig scenario;
  estimator::EstimatorConfig config;
};

std::vector<Look> looks() {
  sim::ScenarioConfig scenario = testing::short_scenario(25);
  scenario.duration_s = 4.5;
  scenario.camera.rate_hz = 10.0;
  estimator::EstimatorConfig config;
  config.type = estimator::EstimatorType::kSlidingWindow;
  config.window = {.keyframes = 6, .kept_points = 8};
  std::vector<Look> result = {{"propagated", scenario, config}};
  Look velocity{"feature_velocity", scenario, config};
  velocity.config.timing = estimator::TimingModel::kFeatureVelocity;
  velocity.config.residual = estimator::ResidualType::kUnitSphere;
  velocity.config.loss = estimator::RobustLoss::kHuber;
  velocity.scenario.points.velocity_source = sim::VelocitySource::kExact;
  result.push_back(velocity);
  Look fixed{"fixed_bearing", scenario, config};
  fixed.config.landmark = estimator::LandmarkType::kFixedBearing;
  fixed.config.estimate.readout = false;
  result.push_back(fixed);
  Look held{"held", scenario, config};
  held.config.estimate = {.td = false, .readout = false, .extrinsics = false};
  held.scenario.prior.means = sim::PriorMeans::kTruth;
  result.push_back(held);
  Look camera{"camera", scenario, config};
  camera.config.estimate.intrinsics = true;
  camera.scenario.prior.focal_sigma_px = camera.scenario.prior.principal_point_sigma_px = 5.0;
  result.push_back(camera);
  Look lines{"lines", scenario, config};
  lines.scenario.world.type = sim::WorldType::kRooms;
  lines.scenario.lines.per_frame = 8;
  result.push_back(lines);
  return result;
}

// Windows as they come about, before and after states have left, each disturbed by a standard deviation a column.
TEST(WindowSolvers, AgreeOnEveryWindow) {
  const LeastSquaresOptions tight{.max_iterations = 100, .step_tolerance = 1e-7};
  int windows = 0;
  for (const Look& look : looks()) {
    const auto s = sim::simulate(look.scenario, {3, 1});
    Window window(s.measurements, look.config);
    for (const std::size_t frame : estimator::select_keyframes(s.measurements.frames, 10.0)) {
      if (!window.add_frame(frame)) continue;
      window.triangulate();
      ASSERT_EQ(window.solve().result.status, core::SolveStatus::kConverged) << look.name << " frame " << frame;
      window.assess(true);
      while (window.size() > 7) window.fold_oldest();
      if (window.size() < 5) continue;

      const LeastSquares problem = window.problem();
      const std::vector<double> at = values_of(problem);
      estimator::SchurSystem system(problem);
      ASSERT_TRUE(system.build(0.0));
      disturb(problem, system, 0.3, frame);
      const std::vector<double> start = values_of(problem);
      const auto by_schur = solve_with_schur(problem, tight, system);
      const std::vector<double> schur = values_of(problem);
      set_values(problem, start);
      const auto by_ceres = solve_with_ceres(problem, tight);
      const std::vector<double> ceres = values_of(problem);

      EXPECT_EQ(by_schur.status, core::SolveStatus::kConverged) << look.name << " frame " << frame;
      EXPECT_EQ(by_ceres.status, core::SolveStatus::kConverged) << look.name << " frame " << frame;
      EXPECT_NEAR(by_schur.initial_cost, by_ceres.initial_cost, 1e-8 * by_ceres.initial_cost);
      EXPECT_NEAR(by_schur.final_cost, by_ceres.final_cost, 1e-8 * std::abs(by_ceres.final_cost)) << look.name;
      // In the information of what is left once the landmarks are eliminated.
      Eigen::VectorXd d(system.columns());
      std::size_t from = 0;
      for (std::size_t b = 0; b < problem.blocks.size(); ++b) {
        const ParameterBlock& block = problem.blocks[b];
        if (!block.eliminated) {
          d.segment(system.column(static_cast<int>(b)), block.dof) = difference(block, &schur[from], &ceres[from]);
        }
        from += static_cast<std::size_t>(block.size);
      }
      ASSERT_TRUE(system.build(0.0));
      const Eigen::MatrixXd H = system.H();
      const double apart = std::sqrt(d.dot(H.selfadjointView<Eigen::Lower>() * d));
      // Ceres ends where the costs of neighbours differ by their rounding: what it would still have to go.
      const auto left = [&](const std::vector<double>& values) {
        set_values(problem, values);
        return system.build(0.0) ? std::sqrt(system.solve().value_or(1.0)) : 1.0;
      };
      EXPECT_LT(left(schur), 1e-6) << look.name << " frame " << frame;
      EXPECT_LT(left(ceres), 1e-4) << look.name << " frame " << frame;
      EXPECT_LT(apart, 1e-6 + 1.1 * left(ceres)) << look.name << " frame " << frame;
      set_values(problem, at);
      ++windows;
#ifdef PLUMBLINE_SANITIZED
      if (windows % 5 == 0) break;  // five of each kind
#endif
    }
  }
#ifndef PLUMBLINE_SANITIZED
  EXPECT_GE(windows, 180);
#endif
}

// Moves and turns of the whole world, as differences of every state: [rho | phi].
Eigen::VectorXd world_direction(const MarginalPrior& prior, int k) {
  Eigen::VectorXd n = Eigen::VectorXd::Zero(prior.gradient.size());
  for (const MarginalPrior::Part& part : prior.parts) {
    if (part.kind != MarginalPrior::Kind::kState) continue;
    n[part.column + (k < 3 ? core::kPosition + k : core::kOrientation + 2)] = 1.0;
  }
  return n;
}

// A camera and an IMU cannot tell where they are, nor how they are turned about the vertical. What is known of that
// comes from the initial state, and may only become less: in the chart of the prior the four directions are the same at
// every linearisation point.
TEST(WindowPrior, FourDirectionsGainNoInformation) {
  sim::ScenarioConfig scenario = testing::short_scenario(40);
  scenario.duration_s = 6.0;
  const auto s = sim::simulate(scenario, {3, 2});
  estimator::EstimatorConfig config;
  config.window = {.keyframes = 6, .kept_points = 15};
  Window window(s.measurements, config);
  const core::InitialPrior& initial = s.measurements.prior;
  const core::StateTangent sigma = initial.sigma.per_axis();
  int folds = 0;
  for (const std::size_t frame : estimator::select_keyframes(s.measurements.frames, 10.0)) {
    ASSERT_TRUE(window.add_frame(frame));
    window.triangulate();
    ASSERT_EQ(window.solve().result.status, core::SolveStatus::kConverged);
    // The state in which the initial information is linearised.
    const core::State first = estimator::unpack_state(window.oldest().x.data());
    static core::State origin;
    if (!window.folded()) origin = first;
    while (window.size() > 6) {
      window.fold_oldest();
      ++folds;
      ASSERT_NE(window.prior(), nullptr);
      for (int k = 0; k < 4; ++k) {
        core::StateTangent xi = core::StateTangent::Zero();
        xi[k < 3 ? core::kPosition + k : core::kOrientation + 2] = 1.0;
        const double given = (estimator::from_invariant(origin) * xi).cwiseQuotient(sigma).squaredNorm();
        const Eigen::VectorXd n = world_direction(*window.prior(), k);
        const double known = n.dot(window.prior()->information * n);
        EXPECT_LT(known, given * (1.0 + 1e-6)) << "direction " << k << " after " << folds;
        EXPECT_GT(known, 0.5 * given) << "direction " << k << " after " << folds;
      }
    }
  }
  EXPECT_GE(folds, 50);
}

// Nothing has left: then it is the batch estimate of all keyframes so far.
TEST(SlidingWindow, BeforeAnythingLeavesItIsTheBatch) {
  sim::ScenarioConfig scenario = testing::short_scenario(40);
  scenario.duration_s = 2.5;
  const auto s = sim::simulate(scenario, {3, 3});
  estimator::EstimatorConfig config;
  const core::EstimateLog batch = estimator::estimate(s.measurements, config);
  config.type = estimator::EstimatorType::kSlidingWindow;
  config.window.keyframes = 1000;
  config.window.keyframe_parallax_px = 0.0;
  config.window.largest_depth_sigma = 1e6;  // the batch has no belief of depths
  for (const auto solver : {estimator::Solver::kSchur, estimator::Solver::kCeres}) {
    config.solver = solver;
    const core::EstimateLog online = estimator::estimate(s.measurements, config);
    ASSERT_EQ(batch.status, core::SolveStatus::kConverged);
    ASSERT_EQ(online.status, core::SolveStatus::kConverged) << online.reason;
    ASSERT_EQ(online.states.back().t_ns, batch.states.back().t_ns);
    // Half a standard deviation in all of some 400 dimensions together is where iterating ends.
    const core::StateTangent d = core::minus(online.states.back().state, batch.states.back().state);
    for (int i = 0; i < core::kStateDof; ++i) {
      const double variance = batch.covariance(core::kCovLastState + i, core::kCovLastState + i);
      EXPECT_LT(std::abs(d[i]), 0.1 * std::sqrt(variance)) << i;
      EXPECT_NEAR(online.covariance(core::kCovLastState + i, core::kCovLastState + i) / variance, 1.0, 0.02) << i;
    }
    EXPECT_LT(std::abs(online.calibration.td_s - batch.calibration.td_s),
              0.1 * std::sqrt(batch.covariance(core::kCovTd, core::kCovTd)));
    EXPECT_NEAR(online.covariance(core::kCovTd, core::kCovTd) / batch.covariance(core::kCovTd, core::kCovTd), 1.0,
                0.02);
  }
}

}  // namespace
}  // namespace plumbline
