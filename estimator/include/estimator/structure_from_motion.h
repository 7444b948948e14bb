// A camera's path from pictures alone, up to scale: two views by the essential matrix, the others by the points that
// are known, then all together.
//   E = [t]x R by five points (Nister, "An efficient solution to the five-point relative pose problem", PAMI 2004) in
//   RANSAC; the other views by PnP in RANSAC (Fischler & Bolles, 1981), outwards from the pair; points from all views
//   that agree on them; last bundle adjustment  min sum rho(|h(R_k^T (X - c_k)) - z|^2 / sigma^2),  rho Cauchy's.
// OpenCV's RANSAC draws from a generator of its own with a fixed seed: the same rays give the same answer.
#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include <Eigen/Core>

#include "core/lie.h"

namespace plumbline::estimator {

// What a picture shows: rays (x, y, 1) of tracks, as if all had been exposed at once.
using PictureRays = std::map<std::int64_t, Eigen::Vector2d>;

struct StructureRules {
  double ray_sigma = 0.0;       // of x and y
  double least_parallax = 0.0;  // of the pair, in the same units
};

// The parallax of two pictures: the median distance of the rays from where the one rotation that suits all best would
// have put them. Zero where they share too little to tell.
double parallax(const PictureRays& a, const PictureRays& b);

// R_C0_Ck and the camera's centres in C0, of each picture; the unit is the pair's distance. Throws NoStart with the
// reason where there is none (estimator/batch_start.h).
std::vector<core::Pose> structure_from_motion(const std::vector<PictureRays>& pictures, const StructureRules& rules);

}  // namespace plumbline::estimator
