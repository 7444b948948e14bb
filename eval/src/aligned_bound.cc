#include "eval/aligned_bound.h"

#include <algorithm>
#include <cmath>

#include <Eigen/QR>

namespace plumbline::eval {
namespace {

Eigen::Matrix3Xd turning_axes(Alignment alignment) {
  switch (alignment) {
    case Alignment::kNone:
      return Eigen::Matrix3Xd(3, 0);
    case Alignment::kPosyaw:
      return Eigen::Vector3d::UnitZ();
    case Alignment::kSe3:
    case Alignment::kSim3:
      return Eigen::Matrix3d::Identity();
  }
  return Eigen::Matrix3Xd(3, 0);
}

}  // namespace

AlignedBound aligned_bound(const InformationChain& chain, const std::vector<core::Pose>& truth,
                           const std::vector<ScaledPose>& rows, const std::vector<PoseCovariance>& covariances,
                           Alignment alignment) {
  const auto N = static_cast<double>(truth.size());
  double trace_p = 0.0;
  double trace_theta = 0.0;
  for (const PoseCovariance& covariance : covariances) {
    trace_p += covariance.topLeftCorner<3, 3>().trace();
    trace_theta += covariance.bottomRightCorner<3, 3>().trace();
  }
  if (alignment != Alignment::kNone) {
    const Eigen::Matrix3Xd U = turning_axes(alignment);
    const Eigen::Index u = U.cols();
    const Eigen::Index g = 3 + u + (alignment == Alignment::kSim3 ? 1 : 0);
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    for (const core::Pose& pose : truth) mean += pose.p / N;

    Eigen::MatrixXd G = Eigen::MatrixXd::Zero(chain.total_dof(), g);
    Eigen::MatrixXd GtG = Eigen::MatrixXd::Zero(g, g);
    for (std::size_t k = 0; k < truth.size(); ++k) {
      const Eigen::Vector3d arm = truth[k].p - mean;
      Eigen::MatrixXd G_k(3, g);
      G_k.leftCols<3>() = Eigen::Matrix3d::Identity();
      G_k.middleCols(3, u) = -core::skew(arm) * U;
      if (alignment == Alignment::kSim3) G_k.rightCols<1>() = arm;
      GtG += G_k.transpose() * G_k;
      G.middleRows<3>(rows[k].position_row) = rows[k].position_unit_m * G_k;
    }
    // A freedom that moves no position, as a turn of a rig that stays where it is, is left as it is.
    const Eigen::MatrixXd inverse = GtG.completeOrthogonalDecomposition().pseudoInverse();
    const Eigen::MatrixXd SigmaG = chain.solve(G);
    const Eigen::MatrixXd GtSigmaG = G.transpose() * SigmaG;
    trace_p -= (inverse * GtSigmaG).trace();
    trace_theta += N * (inverse * GtSigmaG * inverse).block(3, 3, u, u).trace();
    for (std::size_t k = 0; k < truth.size(); ++k) {
      // -Cov(theta_k, c_U)
      const Eigen::MatrixXd covariance =
          rows[k].orientation_unit_rad * (SigmaG.middleRows<3>(rows[k].orientation_row) * inverse).middleCols(3, u);
      trace_theta -= 2.0 * (truth[k].q.toRotationMatrix().transpose() * U).cwiseProduct(covariance).sum();
    }
  }
  if (!std::isfinite(trace_p) || !std::isfinite(trace_theta)) {
    throw std::domain_error("the covariance of the aligned errors is not finite");
  }
  return {.position_m = std::sqrt(std::max(0.0, trace_p) / N),
          .rotation_rad = std::sqrt(std::max(0.0, trace_theta) / N)};
}

}  // namespace plumbline::eval
