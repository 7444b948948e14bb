// A window's least-squares problem, and where its parameters are in it.
#pragma once

#include <stdexcept>
#include <unordered_map>

#include "estimator/window.h"

namespace plumbline::estimator {

struct Window::Built {
  LeastSquares problem;
  std::unordered_map<const double*, int> index;  // blocks by their values
  int extrinsics = -1;
  int td = -1;
  int readout = -1;
  int intrinsics = -1;           // where they are estimated
  std::size_t visual_terms = 0;  // they come first

  int add(double* values, int size, int dof, const ceres::Manifold* manifold);
  int find(const double* values) const {
    const auto found = index.find(values);
    return found == index.end() ? -1 : found->second;
  }
  int of(const double* values) const {
    const int block = find(values);
    if (block < 0) throw std::logic_error("Window: a term of a block that is not in the problem");
    return block;
  }
};

}  // namespace plumbline::estimator
