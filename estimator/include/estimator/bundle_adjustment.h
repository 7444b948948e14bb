// Bundle adjustment of a BAL problem: minimises 1/2 sum |project(R X + t) - (u, v)|^2 over all cameras (with f, k1, k2)
// and points, by Levenberg-Marquardt with the points eliminated (Ceres). The gauge (7 degrees of freedom) stays free;
// the damping keeps it.
#pragma once

#include <array>
#include <string>
#include <string_view>

#include "core/bal_file.h"
#include "core/estimate.h"

namespace plumbline::estimator {

// How the reduced system of the cameras is solved. `automatic`: dense up to 3,000 unknowns, sparse Cholesky up to
// 30,000, conjugate gradients beyond.
enum class BundleSolver { kAutomatic, kDenseSchur, kSparseSchur, kIterativeSchur };
inline constexpr std::array<std::string_view, 4> kBundleSolverNames = {"automatic", "dense_schur", "sparse_schur",
                                                                       "iterative_schur"};

// The perturbation of a camera's rotation: see estimator/factors/bal_factors.h.
enum class BundleRotation { kAngleAxis, kLeft };
inline constexpr std::array<std::string_view, 2> kBundleRotationNames = {"angle_axis", "left"};

struct BundleOptions {
  BundleSolver solver = BundleSolver::kAutomatic;
  BundleRotation rotation = BundleRotation::kAngleAxis;
  int max_iterations = 50;
  double function_tolerance = 1e-6;  // relative change of the cost at which it ends
  int threads = 1;
};

struct BundleResult {
  core::SolveStatus status = core::SolveStatus::kFailedInitialisation;
  std::string reason;                              // where the status is not kConverged
  core::BalProblem problem;                        // cameras and points adjusted
  BundleSolver solver = BundleSolver::kAutomatic;  // what solved it
  double initial_cost = 0.0;                       // half the sum of squares [px^2]
  double final_cost = 0.0;
  int iterations = 0;    // steps tried
  double rmse_px = 0.0;  // root of the mean squared distance of an observation from its projection
  double time_s = 0.0;   // building and solving, wall clock
  int behind = 0;        // observations of points that end up behind their camera
};

BundleResult adjust_bundle(core::BalProblem problem, const BundleOptions& options);

}  // namespace plumbline::estimator
