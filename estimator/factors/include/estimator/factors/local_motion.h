// The body's motion about the instant of a state, carried by the inertial samples over the short gap tau to the time
// of an observation (camera timing `propagated`):
//   R(tau) = R_k dR(tau)          p(tau) = p_k + v_k tau + g tau^2/2 + R_k dp(tau)
//   dR/dtau = dR [omega]x         dp/dtau = dp_dot
// dR and dp are integrated by the midpoint rule of imu_increment.h, the samples taken as linear in time within a step,
// so that both are continuous in tau. From one sample to the next the biases' effect is to first order about those of
// the table, within the last step it is exact. The noise of the samples within the gap is neglected.
#pragma once

#include <span>
#include <vector>

#include <Eigen/Core>

#include "core/measurements.h"
#include "estimator/factors/imu_increment.h"
#include "estimator/factors/skew_product.h"

namespace plumbline::estimator {

// Motion at tau relative to the state, with gravity and initial velocity left out.
struct LocalPose {
  Eigen::Matrix3d R;
  Eigen::Vector3d p;
  Eigen::Vector3d omega;  // body rate at tau
  Eigen::Vector3d p_dot;
};

struct LocalPoseJacobians {
  Eigen::Matrix3d R_bg;  // on the right of R
  Eigen::Matrix3d p_bg;
  Eigen::Matrix3d p_ba;
};

// One step of the table, from a sample to the next, at biases of one's own: what poses within it share.
class LocalStep {
 public:
  bool contains(double tau_s) const { return tau_s >= tau0_s_ && tau_s <= tau1_s_; }
  LocalPose at(double tau_s) const;
  LocalPoseJacobians jacobians(double tau_s, const LocalPose& pose) const;

  // J_p dp/db + J_theta dR/db of the pose at tau_s, without the 3 x 3 Jacobians: the derivatives with respect to the
  // biases of what has the derivatives J_p and J_theta with respect to p and R.
  template <int kRows>
  struct BiasRows {
    Eigen::Matrix<double, kRows, 3> b_g;
    Eigen::Matrix<double, kRows, 3> b_a;
  };
  template <int kRows>
  BiasRows<kRows> pull_back(double tau_s, const LocalPose& pose, const Eigen::Matrix<double, kRows, 3>& J_p,
                            const Eigen::Matrix<double, kRows, 3>& J_theta) const {
    using Rows = Eigen::Matrix<double, kRows, 3>;
    const double u = tau_s - tau0_s_;
    const double quarter_u2 = 0.25 * u * u;
    const Eigen::Vector3d f1 = f0_ + u * accel_slope_;
    // By way of R(tau), then of the rotation at the first sample.
    const Rows J_R = J_theta - quarter_u2 * times_skew(J_p * pose.R, f1);
    const Rows J_R0 = J_R * rotation_within(u).transpose() - quarter_u2 * times_skew(J_p * R0_, f0_);
    BiasRows<kRows> rows;
    rows.b_g.noalias() = J_p * (x_->p_bg + u * x_->v_bg);
    rows.b_g.noalias() += (J_R0 * Jr_correction_) * x_->R_bg;
    rows.b_g.noalias() -= u * (J_R * core::right_jacobian(angle_within(u)));
    rows.b_a.noalias() = J_p * (x_->p_ba + u * x_->v_ba - quarter_u2 * (R0_ + pose.R));
    return rows;
  }

 private:
  friend class LocalMotion;
  Eigen::Vector3d angle_within(double u) const { return u * w0_ + (0.5 * u * u) * gyro_slope_; }
  Eigen::Matrix3d rotation_within(double u) const { return core::exp_so3(angle_within(u)); }

  const ImuIncrement* x_ = nullptr;  // at the first sample, at the biases of the table
  double tau0_s_ = 0.0;
  double tau1_s_ = 0.0;
  Eigen::Matrix3d Jr_correction_;  // of the rotation by which the biases differ from the table's
  Eigen::Matrix3d R0_;             // at the first sample
  Eigen::Vector3d v0_;
  Eigen::Vector3d p0_;
  Eigen::Vector3d w0_;
  Eigen::Vector3d f0_;
  Eigen::Vector3d gyro_slope_;
  Eigen::Vector3d accel_slope_;
};

class LocalMotion {
 public:
  // The state's instant is samples[state_index]; the table reaches reach_s to both sides, or as far as there are
  // samples.
  LocalMotion(std::span<const core::ImuSample> samples, std::size_t state_index, double reach_s,
              const core::ImuBias& bias);

  // False where tau_s is outside the table.
  bool at(double tau_s, const core::ImuBias& bias, LocalPose& pose, LocalPoseJacobians* jacobians = nullptr) const;

  // The step that tau_s lies in; it refers to the table. False as above.
  bool find_step(double tau_s, const core::ImuBias& bias, LocalStep& step) const;

 private:
  struct Node {
    double tau_s = 0.0;
    core::ImuSample sample;
    ImuIncrement increment;
  };
  std::vector<Node> nodes_;
  double nodes_per_s_ = 0.0;  // on average
  core::ImuBias bias_;
};

}  // namespace plumbline::estimator
