// A landmark's way from the anchor camera i to the observing camera j, and the derivatives of what is made of it there.
// With the bearing b = (x, y, 1) and every length times the inverse depth lambda (a picture depends on the direction
// only), so that a landmark at infinity is as good as any:
//   B = R_c b + lambda t_c                  body i      (R_c, t_c) = T_B_C
//   W = R_i B + lambda p_i                  world
//   X = R_j^T (W - lambda p_j)              body j
//   q = R_c^T (X - lambda t_c)              camera j
// Divided by lambda these are the points of the derivation: B = lambda P_bi, q = lambda P_cj.
#pragma once

#include <Eigen/Core>

#include "core/lie.h"
#include "estimator/factors/ray_chart.h"
#include "estimator/factors/skew_product.h"

namespace plumbline::estimator {

// T_W_B or T_B_C as a matrix and a vector.
struct RigidMotion {
  Eigen::Matrix3d R;
  Eigen::Vector3d p;
};

inline RigidMotion rigid_motion(const core::Pose& T) { return {T.q.toRotationMatrix(), T.p}; }

struct PointChain {
  PointChain(const Eigen::Vector3d& bearing, double inverse_depth) : b(bearing), lambda(inverse_depth) {}

  Eigen::Vector3d b;
  double lambda;
  Eigen::Vector3d B;
  Eigen::Vector3d W;
  Eigen::Vector3d X;
  Eigen::Vector3d q;

  void to_world(const RigidMotion& T_B_C, const RigidMotion& T_W_Bi) {
    B.noalias() = T_B_C.R * b + lambda * T_B_C.p;
    W.noalias() = T_W_Bi.R * B + lambda * T_W_Bi.p;
  }
  void to_camera(const RigidMotion& T_B_C, const RigidMotion& T_W_Bj) {
    X.noalias() = T_W_Bj.R.transpose() * (W - lambda * T_W_Bj.p);
    q.noalias() = T_B_C.R.transpose() * (X - lambda * T_B_C.p);
  }
};

// Of r with r' = dr/dq: with respect to the points of the chain, and from there to poses (p additive in the outer
// frame, theta on the right), bearing and inverse depth.
struct PointChainJacobians {
  Matrix23 q;
  Matrix23 X;
  Matrix23 W;
  Matrix23 B;
  Matrix23 b;

  PointChainJacobians(const Matrix23& dr_dq, const RigidMotion& T_B_C, const RigidMotion& T_W_Bi,
                      const RigidMotion& T_W_Bj)
      : q(dr_dq) {
    X.noalias() = q * T_B_C.R.transpose();
    W.noalias() = X * T_W_Bj.R.transpose();
    B.noalias() = W * T_W_Bi.R;
    b.noalias() = B * T_B_C.R;
  }

  Matrix23 anchor_position(const PointChain& c) const { return c.lambda * W; }
  Matrix23 anchor_rotation(const PointChain& c) const { return times_skew(-B, c.B); }
  Matrix23 observer_position(const PointChain& c) const { return -c.lambda * W; }
  Matrix23 observer_rotation(const PointChain& c) const { return times_skew(X, c.X); }
  Matrix23 extrinsic_position(const PointChain& c) const { return c.lambda * (B - X); }
  Matrix23 extrinsic_rotation(const PointChain& c) const { return times_skew(q, c.q) - times_skew(b, c.b); }
  Eigen::Vector2d inverse_depth(const RigidMotion& T_B_C, const RigidMotion& T_W_Bi, const RigidMotion& T_W_Bj) const {
    return (B - X) * T_B_C.p + W * (T_W_Bi.p - T_W_Bj.p);
  }
};

}  // namespace plumbline::estimator
