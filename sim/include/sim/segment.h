// A piece of a straight edge of the world, in world coordinates, metres.
#pragma once

#include <array>

#include <Eigen/Core>

namespace plumbline::sim {

struct Segment {
  std::array<Eigen::Vector3d, 2> ends_W = {Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};

  // 0 is the first end, 1 the second.
  Eigen::Vector3d at(double s) const { return ends_W[0] + s * (ends_W[1] - ends_W[0]); }
};

}  // namespace plumbline::sim
