// The covariance that is left of a trajectory's errors when the trajectory has been aligned to the truth.
//
// With e the errors of N positions (3N, world), an alignment by least squares over all of them takes away, to first
// order, what its own freedoms explain:
//   c = -(G^T G)^-1 G^T e      G_k = [ I | -[p_k - mean p]x U | p_k - mean p ]     e' = e + G c
// U the axes that it may turn about: e_z for posyaw, all three for se3 and sim3; the last column for sim3 only. The
// turn phi = U c_U moves the orientations too, theta'_k = theta_k + R_k^T phi. Hence, with Sigma the *joint*
// covariance,
//   N rms_p^2     = tr Sigma_pp - tr( (G^T G)^-1 G^T Sigma_pp G )
//   N rms_theta^2 = sum_k tr( Cov(theta_k) ) + 2 tr( R_k^T U Cov(c_U, theta_k) ) + tr( Cov(c_U) )
#pragma once

#include <vector>

#include <Eigen/Core>

#include "core/lie.h"
#include "eval/alignment.h"
#include "eval/information_chain.h"

namespace plumbline::eval {

using PoseCovariance = Eigen::Matrix<double, 6, 6>;  // [ p (m, world) | theta (rad, body) ]

// Where a pose's error lies among the variables of a chain, x = error / unit.
struct ScaledPose {
  int position_row = 0;
  int orientation_row = 0;
  double position_unit_m = 1.0;
  double orientation_unit_rad = 1.0;
};

// Root of the mean square over the poses, and of the expectation over the errors.
struct AlignedBound {
  double position_m = 0.0;
  double rotation_rad = 0.0;
};

// The chain is finished; truth, rows and covariances (unaligned, of each pose) belong together.
AlignedBound aligned_bound(const InformationChain& chain, const std::vector<core::Pose>& truth,
                           const std::vector<ScaledPose>& rows, const std::vector<PoseCovariance>& covariances,
                           Alignment alignment);

}  // namespace plumbline::eval
