#include "eval/pose_consistency.h"

#include <cmath>

#include <fmt/format.h>

#include "core/lie.h"
#include "eval/nees.h"

namespace plumbline::eval {

PoseConsistencyResult pose_consistency(const std::vector<PosePair>& pairs,
                                       const std::vector<core::PoseCovariance>& covariances) {
  if (pairs.empty()) return {.consistency = {}, .reason = "no poses"};
  PoseConsistency sum;
  for (const PosePair& pair : pairs) {
    const core::PoseCovariance& P = covariances.at(pair.estimate_index);
    Eigen::Matrix<double, 6, 1> e;
    e << pair.estimate.p - pair.truth.p, core::log_so3(pair.truth.q.conjugate() * pair.estimate.q);
    const auto pose = nees(e, P);
    const auto position = nees(e.head<3>(), P.topLeftCorner<3, 3>());
    const auto orientation = nees(e.tail<3>(), P.bottomRightCorner<3, 3>());
    if (!pose || !position || !orientation) {
      return {.consistency = {},
              .reason = fmt::format("the covariance of pose {} is singular or indefinite", pair.estimate_index)};
    }
    sum.nees_pose += *pose;
    sum.nees_position += *position;
    sum.nees_orientation += *orientation;
    for (int i = 0; i < 6; ++i) sum.within_3_sigma(i) += std::abs(e(i)) <= 3.0 * std::sqrt(P(i, i)) ? 1.0 : 0.0;
  }
  const auto n = static_cast<double>(pairs.size());
  return {.consistency = PoseConsistency{.within_3_sigma = sum.within_3_sigma / n,
                                         .nees_pose = sum.nees_pose / n,
                                         .nees_position = sum.nees_position / n,
                                         .nees_orientation = sum.nees_orientation / n},
          .reason = {}};
}

nlohmann::ordered_json to_json(const PoseConsistency& consistency) {
  nlohmann::ordered_json within = nlohmann::ordered_json::array();
  for (const double share : consistency.within_3_sigma) within.push_back(share);
  return {{"error", "[p_est - p_true (world), Log(R_true^T R_est) (body)], not aligned"},
          {"within_3_sigma", within},
          {"nees_pose", consistency.nees_pose},
          {"nees_position", consistency.nees_position},
          {"nees_orientation", consistency.nees_orientation}};
}

}  // namespace plumbline::eval
