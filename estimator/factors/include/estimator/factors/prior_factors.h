// Priors: what is known beforehand, as measurements with Gaussian noise in the perturbations of core/state.h.
//   r = (mean [-] x) / sigma
// so that, at the truth, the residual of a mean drawn as truth [+] n with n ~ N(0, sigma^2) is n/sigma exactly.
#pragma once

#include <ceres/sized_cost_function.h>

#include "estimator/factors/parameter_blocks.h"

namespace plumbline::estimator {

class StatePriorFactor final : public ceres::SizedCostFunction<core::kStateDof, kStateSize> {
 public:
  StatePriorFactor(const core::State& mean, const core::StateSigmas& sigma) : mean_(mean), sigma_(sigma.per_axis()) {}

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override;

 private:
  core::State mean_;
  core::StateTangent sigma_;
};

class ExtrinsicsPriorFactor final : public ceres::SizedCostFunction<6, kPoseSize> {
 public:
  ExtrinsicsPriorFactor(const core::Pose& mean, double position_sigma_m, double rotation_sigma_rad)
      : mean_(mean), position_sigma_m_(position_sigma_m), rotation_sigma_rad_(rotation_sigma_rad) {}

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override;

 private:
  core::Pose mean_;
  double position_sigma_m_;
  double rotation_sigma_rad_;
};

// For td and readout.
class ScalarPriorFactor final : public ceres::SizedCostFunction<1, 1> {
 public:
  ScalarPriorFactor(double mean, double sigma) : mean_(mean), sigma_(sigma) {}

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override;

 private:
  double mean_;
  double sigma_;
};

// For (fx, fy, cx, cy).
class IntrinsicsPriorFactor final : public ceres::SizedCostFunction<kIntrinsicsSize, kIntrinsicsSize> {
 public:
  IntrinsicsPriorFactor(const core::Intrinsics& mean, double focal_sigma_px, double principal_point_sigma_px)
      : mean_(mean), sigma_(focal_sigma_px, focal_sigma_px, principal_point_sigma_px, principal_point_sigma_px) {}

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override;

 private:
  core::Intrinsics mean_;
  core::Intrinsics sigma_;
};

}  // namespace plumbline::estimator
