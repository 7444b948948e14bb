// A segment of a cumulative B-spline on SO(3), of order k:
//   R(u) = R_0 prod_{j=1..k-1} A_j,   A_j = Exp(lambda_j(u) d_j),   d_j = Log(R_{j-1}^T R_j)
// with rate and angular acceleration in the body, dR/dt = R [omega]x, alpha = d omega/dt, by the recursions
//   omega_j = w_j + lambda_j' d_j,   alpha_j = A_j^T alpha_{j-1} + lambda_j' omega_j x d_j + lambda_j'' d_j
// where w_j = A_j^T omega_{j-1}. Sommer, Usenko, Schubert, Demmel, Cremers, "Efficient derivative computation for
// cumulative B-splines on Lie groups", CVPR 2020, section 4.
//
// Derivatives on the right of all rotations, P_j = A_{j+1} ... A_{k-1}:
//   dtheta = P_j^T lambda_j Jr(lambda_j d_j) dd_j,   domega = P_j^T ([w_j]x lambda_j Jr(lambda_j d_j) + lambda_j') dd_j
//   dd_j = Jr^-1(d_j) dtheta_j - Jr^-1(d_j)^T dtheta_{j-1}
#pragma once

#include <array>

#include <Eigen/Core>

#include "core/bspline_basis.h"
#include "core/lie.h"

namespace plumbline::core {

class RotationSpline {
 public:
  using Steps = std::array<Eigen::Vector3d, bspline::kMostOrder>;  // d_j at j; the first is not used

  RotationSpline(int order, const Eigen::Quaterniond& first, const Steps& steps)
      : order_(order), first_(first), d_(steps) {}

  // Goes to the time that the weights are of.
  void to(const bspline::Weights& w);
  const Eigen::Quaterniond& q() const { return q_; }
  const Eigen::Vector3d& omega() const { return omega_; }
  const Eigen::Vector3d& alpha() const { return alpha_; }

  // Derivatives with respect to the k rotations of what has the derivatives J_theta by R(u) and J_omega by omega there.
  template <int kRows>
  using Rows = Eigen::Matrix<double, kRows, 3>;
  template <int kRows>
  std::array<Rows<kRows>, bspline::kMostOrder> pull_back(Rows<kRows> J_theta,
                                                         Rows<kRows> J_omega = Rows<kRows>::Zero()) const {
    std::array<Rows<kRows>, bspline::kMostOrder> J;
    Rows<kRows> by_end = Rows<kRows>::Zero();  // of the step that begins at rotation j
    for (int j = order_ - 1; j > 0; --j) {
      const auto i = static_cast<std::size_t>(j);
      const Eigen::Matrix3d Jr_inverse = right_jacobian_inverse(d_[i]);
      const Rows<kRows> J_d = lambda_[j] * ((J_theta + J_omega * skew(w_[i])) * right_jacobian(lambda_[j] * d_[i])) +
                              lambda_dot_[j] * J_omega;
      J[i] = J_d * Jr_inverse - by_end;
      by_end = J_d * Jr_inverse.transpose();
      const Eigen::Matrix3d A = A_[i].toRotationMatrix();
      J_theta = (J_theta * A.transpose()).eval();
      J_omega = (J_omega * A.transpose()).eval();
    }
    J[0] = J_theta - by_end;
    return J;
  }

 private:
  int order_;
  Eigen::Quaterniond first_;
  Steps d_;
  bspline::Basis lambda_;
  bspline::Basis lambda_dot_;
  std::array<Eigen::Quaterniond, bspline::kMostOrder> A_;
  std::array<Eigen::Vector3d, bspline::kMostOrder> w_;
  Eigen::Quaterniond q_;
  Eigen::Vector3d omega_;
  Eigen::Vector3d alpha_;
};

}  // namespace plumbline::core
