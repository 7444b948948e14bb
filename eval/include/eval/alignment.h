// The transform that brings an estimated trajectory to the true one:   x_truth ~ s R x_estimate + t,
// minimising sum_k |x_truth,k - (s R x_estimate,k + t)|^2 over
//   none    nothing                 s = 1, R = I, t = 0
//   posyaw  t and a turn about z    what visual-inertial odometry cannot observe; needs 2 positions
//   se3     t and R                 needs 3 positions that do not lie on a line
//   sim3    t, R and s              likewise
// Only positions are compared; orientations are merely turned along. R acts on the left, in the truth's frame.
//
// se3, sim3: Umeyama, "Least-squares estimation of transformation parameters between two point patterns", PAMI 1991.
// posyaw: Zhang & Scaramuzza, "A tutorial on quantitative trajectory evaluation for visual(-inertial) odometry",
// IROS 2018, whose closed form is  yaw = atan2(C_10 - C_01, C_00 + C_11),  C = sum_k (x_truth - mean)(x_est - mean)^T.
#pragma once

#include <array>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "core/lie.h"

namespace plumbline::eval {

enum class Alignment { kNone, kPosyaw, kSe3, kSim3 };
inline constexpr std::array<std::string_view, 4> kAlignmentNames = {"none", "posyaw", "se3", "sim3"};

// x -> s R x + t
struct Similarity {
  double s = 1.0;
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
  Eigen::Vector3d t = Eigen::Vector3d::Zero();

  Eigen::Vector3d operator*(const Eigen::Vector3d& x) const { return s * (R * x) + t; }
  core::Pose operator*(const core::Pose& T) const { return {(Eigen::Quaterniond(R) * T.q).normalized(), *this * T.p}; }
};

struct AlignmentResult {
  bool ok = false;
  std::string reason;              // where not ok
  Similarity truth_from_estimate;  // the identity where not ok
};

// The first `first_n` positions decide (0: all of them). Not ok where the positions do not determine the transform:
// too few of them, values that are not finite, for se3 and sim3 no motion or motion along one line only.
// posyaw without horizontal motion (a rig at rest) is ok: every yaw is as good, and the smallest, 0, is taken.
// Throws std::invalid_argument where the sizes differ or first_n < 0.
AlignmentResult align(const std::vector<Eigen::Vector3d>& estimate, const std::vector<Eigen::Vector3d>& truth,
                      Alignment alignment, int first_n = 0);

}  // namespace plumbline::eval
