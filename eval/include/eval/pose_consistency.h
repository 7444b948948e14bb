// Whether the covariances that come with a trajectory speak of its errors. e_k is the error of pose k without any
// alignment, in the perturbation of core/pose_covariance_file.h, and P_k its stated covariance.
//   within_3_sigma   the share of poses with |e_k,i| <= 3 sqrt(P_k,ii), an axis i
//   nees             mean over k of e_k^T P_k^-1 e_k, of the pose (6), the position (3) and the orientation (3)
// The errors of one trajectory follow each other, so these are descriptions and have no band; bands are for figures
// over independent trials (eval/summary.h).
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "core/pose_covariance_file.h"
#include "eval/association.h"

namespace plumbline::eval {

struct PoseConsistency {
  Eigen::Matrix<double, 6, 1> within_3_sigma = Eigen::Matrix<double, 6, 1>::Zero();  // shares in [0, 1]
  double nees_pose = 0.0;
  double nees_position = 0.0;
  double nees_orientation = 0.0;
};

struct PoseConsistencyResult {
  std::optional<PoseConsistency> consistency;
  std::string reason;  // where there is none
};

// `covariances` has one for each pose of the estimate that the pairs come from. None where a covariance is not
// positive definite.
PoseConsistencyResult pose_consistency(const std::vector<PosePair>& pairs,
                                       const std::vector<core::PoseCovariance>& covariances);

// {"error": [...], "within_3_sigma": [x, y, z, rx, ry, rz], "nees_pose", "nees_position", "nees_orientation"}
nlohmann::ordered_json to_json(const PoseConsistency& consistency);

}  // namespace plumbline::eval
