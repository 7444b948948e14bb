// Pluecker coordinates of a line in space, about the origin of the frame they are in:
//   L = (n, d),  d its direction,  n = P x d for any of its points P,  n.d = 0;  any positive scale is the same line
// |n|/|d| is the distance from the origin. The line through C and D, from C to D: n = C x D, d = D - C.
// To another frame, (R, t) the pose of that frame in this one:  n' = R^T (n - t x d),  d' = R^T d.
// Bartoli, Sturm, "Structure-from-motion using lines", CVIU 2005. (Some texts have n = d x P: every block that holds t
// then changes its sign.)
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace plumbline::estimator {

struct PluckerLine {
  Eigen::Vector3d n = Eigen::Vector3d::Zero();
  Eigen::Vector3d d = Eigen::Vector3d::Zero();

  // The foot of the perpendicular from the origin.
  Eigen::Vector3d nearest_point() const { return d.cross(n) / d.squaredNorm(); }
};

inline PluckerLine line_through(const Eigen::Vector3d& C, const Eigen::Vector3d& D) { return {C.cross(D), D - C}; }

// The line in a frame whose pose in the present one is (R, t).
inline PluckerLine in_frame(const PluckerLine& L, const Eigen::Matrix3d& R, const Eigen::Vector3d& t) {
  return {R.transpose() * (L.n - t.cross(L.d)), R.transpose() * L.d};
}

}  // namespace plumbline::estimator
