#include "estimator/ray_bundle.h"

#include <deque>

#include "estimator/robust_loss.h"
#include "estimator/schur_system.h"

namespace plumbline::estimator {

bool RayFactor::Evaluate(double const* const* parameters, double* residuals, double** jacobians) const {
  const core::Pose T = unpack_pose(parameters[0]);
  const Eigen::Matrix3d R_T = T.q.conjugate().toRotationMatrix();
  const Eigen::Vector3d q = R_T * (Eigen::Map<const Eigen::Vector3d>(parameters[1]) - T.p);
  if (!(q.z() > 0.0)) return false;
  Eigen::Map<Eigen::Vector2d> r(residuals);
  r = (q.head<2>() / q.z() - ray_) / sigma_;
  if (jacobians == nullptr) return true;
  Eigen::Matrix<double, 2, 3> J_q;
  J_q << 1.0, 0.0, -q.x() / q.z(), 0.0, 1.0, -q.y() / q.z();
  J_q /= q.z() * sigma_;
  if (jacobians[0] != nullptr) {
    Eigen::Matrix<double, 2, 6> J;
    J << -J_q * R_T, J_q * core::skew(q);
    Eigen::Map<Eigen::Matrix<double, 2, kPoseSize, Eigen::RowMajor>> ambient(jacobians[0]);
    lift_state_jacobian(J, T.q, ambient);
  }
  if (jacobians[1] != nullptr) {
    Eigen::Map<Eigen::Matrix<double, 2, 3, Eigen::RowMajor>> ambient(jacobians[1]);
    ambient = J_q * R_T;
  }
  return true;
}

bool adjust_rays(std::vector<core::Pose>& poses, std::vector<RayPoint>& points, double sigma) {
  constexpr double kLossScale = 2.0;  // in sigmas
  const auto loss = make_loss(RobustLoss::kCauchy, kLossScale);
  PoseManifold manifold;
  std::vector<PoseBlock> blocks;
  for (const core::Pose& pose : poses) blocks.push_back(pack(pose));
  LeastSquares problem;
  for (PoseBlock& block : blocks) {
    problem.blocks.push_back({.values = block.data(), .size = kPoseSize, .dof = 6, .manifold = &manifold});
  }
  problem.blocks.front().constant = true;
  std::deque<RayFactor> factors;  // they cannot be moved
  for (RayPoint& point : points) {
    problem.blocks.push_back({.values = point.X.data(), .size = 3, .dof = 3, .eliminated = true});
    for (const RaySight& sight : point.sights) {
      ResidualTerm term{.factor = &factors.emplace_back(sight.ray, sigma), .count = 2, .loss = loss.get()};
      term.blocks = {static_cast<int>(sight.pose), static_cast<int>(problem.blocks.size()) - 1};
      problem.terms.push_back(term);
    }
  }
  SchurSystem system(problem);
  // What the next stages make of the poses is far coarser than a thousandth of the cost.
  const LeastSquaresResult result =
      solve_with_schur(problem, {.max_iterations = 30, .step_tolerance = 0.1, .cost_tolerance = 1e-3}, system);
  for (std::size_t k = 0; k < poses.size(); ++k) poses[k] = unpack_pose(blocks[k].data());
  return result.status != core::SolveStatus::kDiverged;
}

}  // namespace plumbline::estimator
