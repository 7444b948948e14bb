// Inertial factor between two states, from a preintegration (Forster et al., TRO 2017, eq. 45; g = (0, 0, -gravity)):
//   r_p     = R_i^T (p_j - p_i - v_i dt - g dt^2/2) - (dp + dp/db_g d_bg + dp/db_a d_ba)
//   r_theta = Log( (dR Exp(dR/db_g d_bg))^T R_i^T R_j )
//   r_v     = R_i^T (v_j - v_i - g dt) - (dv + dv/db_g d_bg + dv/db_a d_ba)
//   r_b     = b_j - b_i                                   with d_b = b_i - the bias of the preintegration
// whitened by the square-root information of the preintegration.
#pragma once

#include <ceres/sized_cost_function.h>

#include "estimator/factors/parameter_blocks.h"
#include "estimator/factors/preintegration.h"

namespace plumbline::estimator {

class ImuFactor final : public ceres::SizedCostFunction<core::kStateDof, kStateSize, kStateSize> {
 public:
  ImuFactor(const Preintegration& preintegration, double gravity_m_s2)
      : preintegration_(preintegration), gravity_W_(0.0, 0.0, -gravity_m_s2) {}

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override;

 private:
  Preintegration preintegration_;
  Eigen::Vector3d gravity_W_;
};

}  // namespace plumbline::estimator
