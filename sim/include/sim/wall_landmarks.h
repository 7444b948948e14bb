// Landmarks on the faces of walls, uniform over their area.
#pragma once

#include <vector>

#include "core/random.h"
#include "sim/walls.h"

namespace plumbline::sim {

// A landmark lies this far before the face, so that the wall hides it from behind.
inline constexpr double kBeforeWallM = 0.005;

// Draws faces by their area.
class FacesByArea {
 public:
  // Refers to the faces as long as it lives.
  explicit FacesByArea(const std::vector<Wall>& faces);

  // For u uniform on [0, 1].
  const Wall& at(double u) const;

 private:
  const std::vector<Wall>& faces_;
  std::vector<double> area_up_to_;
};

// `faces` have their normals towards where they are seen from. Landmark i depends on the stream, i and the faces only.
std::vector<Eigen::Vector3d> scatter_on(const std::vector<Wall>& faces, int landmarks,
                                        const core::RandomStream& stream);

}  // namespace plumbline::sim
