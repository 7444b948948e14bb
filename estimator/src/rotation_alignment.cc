#include "estimator/rotation_alignment.h"

#include <Eigen/Cholesky>

#include "core/lie.h"
#include "estimator/imu_path.h"

namespace plumbline::estimator {
namespace {

using Unknowns = Eigen::Matrix<double, 7, 1>;  // [ b_g | td | theta_B_C ], each in its sigma
using Rows = Eigen::Matrix<double, 3, 7>;

}  // namespace

std::optional<RotationAlignment> align_rotations(std::span<const core::ImuSample> imu, core::TimeNs origin_ns,
                                                 std::span<const double> stamps_s,
                                                 const std::vector<Eigen::Quaterniond>& rotations, double sigma_rad,
                                                 const RotationPrior& prior) {
  constexpr int kMostFits = 20;
  constexpr double kSmallStep = 1e-4;  // in sigmas
  Unknowns sigma;
  sigma << Eigen::Vector3d::Constant(prior.gyro_bias_sigma_rad_s), prior.td_sigma_s,
      Eigen::Vector3d::Constant(prior.R_B_C_sigma_rad);
  RotationAlignment result{.td_s = prior.td_s, .R_B_C = prior.R_B_C};
  Unknowns u = Unknowns::Zero();
  for (int iteration = 0; iteration < kMostFits; ++iteration) {
    const ImuPath path = imu_path(imu, origin_ns, stamps_s, result.td_s, {.gyro_rad_s = result.gyro_bias_rad_s});
    const Eigen::Matrix3d R_B_C = result.R_B_C.toRotationMatrix();
    Eigen::Matrix<double, 7, 7> N = Eigen::Matrix<double, 7, 7>::Identity();
    Unknowns h = u;
    double squares = 0.0;
    for (std::size_t k = 0; k + 1 < rotations.size(); ++k) {
      const ImuIncrement& from = path.motion[k];
      const ImuIncrement& to = path.motion[k + 1];
      const Eigen::Matrix3d D = from.R.transpose() * to.R;
      const Eigen::Matrix3d turn_C = (rotations[k].conjugate() * rotations[k + 1]).toRotationMatrix();
      const Eigen::Matrix3d E = (R_B_C * turn_C * R_B_C.transpose()).transpose() * D;
      const Eigen::Vector3d r = core::log_so3(Eigen::Quaterniond(E)) / sigma_rad;
      Rows J;
      J << to.R_bg - D.transpose() * from.R_bg, path.rate_B[k + 1] - D.transpose() * path.rate_B[k],
          -E.transpose() * R_B_C * (turn_C.transpose() - Eigen::Matrix3d::Identity());
      J = (core::right_jacobian_inverse(sigma_rad * r) * J * sigma.asDiagonal() / sigma_rad).eval();
      N += J.transpose() * J;
      h += J.transpose() * r;
      squares += r.squaredNorm();
    }
    result.residual = squares / (3.0 * static_cast<double>(rotations.size() - 1));
    const Unknowns step = -N.ldlt().solve(h);
    if (!step.allFinite()) return std::nullopt;
    u += step;
    result.gyro_bias_rad_s += sigma.head<3>().cwiseProduct(step.head<3>());
    result.td_s += sigma[3] * step[3];
    result.R_B_C =
        (result.R_B_C * core::exp_quaternion(sigma.tail<3>().cwiseProduct(step.tail<3>()).eval())).normalized();
    if (step.norm() < kSmallStep) return result;
  }
  return std::nullopt;
}

}  // namespace plumbline::estimator
