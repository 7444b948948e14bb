#include "estimator/scale_alignment.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>

namespace plumbline::estimator {
namespace {

constexpr int kScale = 0;
constexpr int kOffset = 1;
constexpr int kSpeed = 4;
constexpr int kAccelBiasColumn = 7;
constexpr int kGravity = 10;

// [ s | p_0 | v_0 | b_a | g ]; of g three columns, or two on its sphere.
struct LinearSystem {
  Eigen::MatrixXd A;
  Eigen::VectorXd y;
};

LinearSystem linear_system(const ImuPath& path, const std::vector<Eigen::Vector3d>& centres_C0,
                           const core::Pose& T_B_C) {
  const auto n = static_cast<Eigen::Index>(centres_C0.size());
  LinearSystem system{Eigen::MatrixXd(3 * n, kGravity + 3), Eigen::VectorXd(3 * n)};
  for (Eigen::Index k = 0; k < n; ++k) {
    const auto i = static_cast<std::size_t>(k);
    const double t = path.t_s[i];
    const ImuIncrement& motion = path.motion[i];
    auto A = system.A.middleRows<3>(3 * k);
    A.col(kScale) = T_B_C.q * centres_C0[i];
    A.middleCols<3>(kOffset) = -Eigen::Matrix3d::Identity();
    A.middleCols<3>(kSpeed) = -t * Eigen::Matrix3d::Identity();
    A.middleCols<3>(kAccelBiasColumn) = -motion.p_ba;
    A.middleCols<3>(kGravity) = -0.5 * t * t * Eigen::Matrix3d::Identity();
    system.y.segment<3>(3 * k) = motion.p + motion.R * T_B_C.p - T_B_C.p;
  }
  return system;
}

// Two unit vectors across g.
Eigen::Matrix<double, 3, 2> tangent(const Eigen::Vector3d& g) {
  const Eigen::Vector3d a = g.unitOrthogonal();
  Eigen::Matrix<double, 3, 2> B;
  B << a, g.normalized().cross(a);
  return B;
}

}  // namespace

std::optional<ScaleAlignment> align_scale(const ImuPath& path, const std::vector<Eigen::Vector3d>& centres_C0,
                                          const core::Pose& T_B_C, double gravity_m_s2, double accel_bias_sigma_m_s2) {
  constexpr int kRounds = 6;
  constexpr double kFirstSigmaM = 0.01;  // of a centre, until the residuals tell
  constexpr double kLeastSigmaM = 1e-6;
  const LinearSystem system = linear_system(path, centres_C0, T_B_C);
  const Eigen::Index rows = system.A.rows();
  double sigma_m = kFirstSigmaM;
  Eigen::Vector3d g = Eigen::Vector3d::Zero();
  ScaleAlignment result;
  for (int round = 0; round < kRounds; ++round) {
    Eigen::MatrixXd A = system.A;
    Eigen::VectorXd y = system.y;
    if (round > 0) {
      y -= system.A.middleCols<3>(kGravity) * g;
      A.middleCols<2>(kGravity) = system.A.middleCols<3>(kGravity) * tangent(g);
      A.conservativeResize(Eigen::NoChange, kGravity + 2);
    }
    Eigen::MatrixXd N = A.transpose() * A / (sigma_m * sigma_m);
    N.diagonal().segment<3>(kAccelBiasColumn).array() += 1.0 / (accel_bias_sigma_m_s2 * accel_bias_sigma_m_s2);
    const auto factor = N.ldlt();
    const Eigen::VectorXd x = factor.solve(A.transpose() * y) / (sigma_m * sigma_m);
    if (factor.info() != Eigen::Success || !x.allFinite()) return std::nullopt;
    g += round > 0 ? Eigen::Vector3d(tangent(g) * x.segment<2>(kGravity)) : Eigen::Vector3d(x.segment<3>(kGravity));
    g *= gravity_m_s2 / g.norm();
    const double variance = factor.solve(Eigen::VectorXd::Unit(A.cols(), kScale))[kScale];
    result = {.scale = x[kScale],
              .relative_sigma = std::sqrt(variance) / x[kScale],
              .v_B0 = x.segment<3>(kSpeed),
              .gravity_B0 = g,
              .accel_bias_m_s2 = x.segment<3>(kAccelBiasColumn)};
    const double squares = (A * x - y).squaredNorm();
    sigma_m = std::max(kLeastSigmaM, std::sqrt(squares / static_cast<double>(rows - A.cols())));
  }
  if (!(result.scale > 0.0) || !std::isfinite(result.relative_sigma)) return std::nullopt;
  return result;
}

}  // namespace plumbline::estimator
