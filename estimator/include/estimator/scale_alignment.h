// The scale of a camera's path, gravity, velocity and the accelerometer's bias, by one linear system. In the body frame
// of the first picture (R_k, alpha_k, A_k = d alpha_k/d b_a: the IMU's path to picture k, t_k the time since):
//   s R_B_C c_k + p_B_C - R_k p_B_C = p_0 + v_0 t_k + g t_k^2/2 + alpha_k + A_k b_a
// with c_k the camera's centre in the first camera's frame, in units of s, and p_0 what the first picture's noise
// amounts to. First with any g, then with |g| known: g on its sphere, two degrees of freedom about the last g (Qin, Li,
// Shen, "VINS-Mono", TRO 2018, section V-B, which leaves b_a out). b_a has a normal prior about zero.
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

#include "core/lie.h"
#include "estimator/imu_path.h"

namespace plumbline::estimator {

struct ScaleAlignment {
  double scale = 0.0;  // metres a unit
  // sigma(s)/s, by the residuals: the excitation. Without acceleration s and v_0 can be told apart by nothing.
  double relative_sigma = 0.0;
  Eigen::Vector3d v_B0 = Eigen::Vector3d::Zero();        // m/s
  Eigen::Vector3d gravity_B0 = Eigen::Vector3d::Zero();  // m/s^2
  Eigen::Vector3d accel_bias_m_s2 = Eigen::Vector3d::Zero();
};

// Of five pictures or more. Nothing where the system is singular or the scale comes out negative.
std::optional<ScaleAlignment> align_scale(const ImuPath& path, const std::vector<Eigen::Vector3d>& centres_C0,
                                          const core::Pose& T_B_C, double gravity_m_s2, double accel_bias_sigma_m_s2);

}  // namespace plumbline::estimator
