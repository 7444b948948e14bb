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

class LocalMotion {
 public:
  // The state's instant is samples[state_index]; the table reaches reach_s to both sides, or as far as there are
  // samples.
  LocalMotion(std::span<const core::ImuSample> samples, std::size_t state_index, double reach_s,
              const core::ImuBias& bias);

  // False where tau_s is outside the table.
  bool at(double tau_s, const core::ImuBias& bias, LocalPose& pose, LocalPoseJacobians* jacobians = nullptr) const;

 private:
  struct Node {
    double tau_s = 0.0;
    core::ImuSample sample;
    ImuIncrement increment;
  };
  std::vector<Node> nodes_;
  core::ImuBias bias_;
};

}  // namespace plumbline::estimator
