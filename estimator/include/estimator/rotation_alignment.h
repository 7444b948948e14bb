// The gyroscope's bias, td and the camera's orientation on the body, from how the camera turns between pictures:
//   r_k = Log( (R_B_C R_k,k+1 R_B_C^T)^T D_k ) / sigma      D_k = Gamma(t_k + td)^T Gamma(t_k+1 + td)
// R_k,k+1 from pictures, Gamma the gyroscope's path with the bias b_g. To first order, on the right of D_k,
//   d/d b_g = dGamma/db of the interval     d/d td = w(t_k+1) - D_k^T w(t_k)
//   d/d theta_B_C = -E^T R_B_C (R_k,k+1^T - I),  E = (R_B_C R_k,k+1 R_B_C^T)^T D_k
// (td: Qin & Shen, "Online temporal calibration for monocular visual-inertial systems", IROS 2018, find it by the
// image's velocity; here a turn that comes late is a turn that comes late). Gauss and Newton, with the priors below.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include <Eigen/Geometry>

#include "core/measurements.h"

namespace plumbline::estimator {

// Normal, the bias about zero; a sigma of zero holds.
struct RotationPrior {
  double td_s = 0.0;
  double td_sigma_s = 0.0;
  Eigen::Quaterniond R_B_C = Eigen::Quaterniond::Identity();
  double R_B_C_sigma_rad = 0.0;
  double gyro_bias_sigma_rad_s = 0.0;
};

struct RotationAlignment {
  Eigen::Vector3d gyro_bias_rad_s = Eigen::Vector3d::Zero();
  double td_s = 0.0;
  Eigen::Quaterniond R_B_C = Eigen::Quaterniond::Identity();
  double residual = 0.0;  // mean square of the r_k's components
};

// `stamps_s` are the pictures' in the camera clock after origin_ns, `rotations` R_C0_Ck. Nothing where it does not
// converge.
std::optional<RotationAlignment> align_rotations(std::span<const core::ImuSample> imu, core::TimeNs origin_ns,
                                                 std::span<const double> stamps_s,
                                                 const std::vector<Eigen::Quaterniond>& rotations, double sigma_rad,
                                                 const RotationPrior& prior);

}  // namespace plumbline::estimator
