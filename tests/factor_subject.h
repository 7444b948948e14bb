// A factor as the laws (factor_laws.h) and the benchmarks (factor_benchmarks.cc) see it: scenes with the factor, its
// reference and parameter blocks, and what its model neglects.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <ostream>
#include <string>
#include <vector>

#include <ceres/autodiff_cost_function.h>
#include <ceres/cost_function.h>
#include <gtest/gtest.h>

#include "core/lie.h"
#include "factor_checks.h"

namespace plumbline::testing {

struct SceneRequest {
  std::uint64_t scene = 0;  // which geometry
  double noise = 0.0;       // of the measurements, in units of what the factor believes in
  std::uint64_t draw = 0;   // which noise
  bool off_truth = false;   // parameters away from the truth, so that no term of a Jacobian vanishes
  core::Pose T_new_W = {};  // yaw and translation of the whole world, displaced parameters and all
};

struct FactorScene {
  std::unique_ptr<ceres::CostFunction> factor;
  std::unique_ptr<ceres::CostFunction> reference;  // the plain formula, by automatic differentiation
  std::vector<Block> blocks;
};

template <class Plain, int kResiduals, int... kSizes>
std::unique_ptr<ceres::CostFunction> automatic(const Plain& plain) {
  return std::make_unique<ceres::AutoDiffCostFunction<Plain, kResiduals, kSizes...>>(new Plain(plain));
}

struct FactorSubject {
  std::string name;
  std::function<FactorScene(const SceneRequest&)> scene;
  std::function<std::vector<FactorScene>()> limits;
  double zero_tolerance = 1e-9;        // of whitened residuals at the truth; what the model itself neglects
  double automatic_tolerance = 1e-10;  // relative to the largest entry of a block
  double ridders_tolerance = 1e-6;     // likewise; what differences across the model's kinks leave
  double zero_floor = 1e-12;           // the least that those of a block are relative to, where one vanishes
  double whitening_slack = 0.0;        // of the covariance: what the noise model neglects knowingly
  bool in_world = true;                // parameters and data refer to the world's frame
};

inline void PrintTo(const FactorSubject& subject, std::ostream* out) { *out << subject.name; }
inline std::string subject_name(const ::testing::TestParamInfo<FactorSubject>& info) { return info.param.name; }

}  // namespace plumbline::testing
