// A line's way from the world (about its own origin o) to the camera, and back for derivatives.
//   n_b = R_wb^T (n - (p_wb - o) x d),  d_b = R_wb^T d            body
//   n_c = R_c^T (n_b - t_c x d_b)                                 camera, (R_c, t_c) = T_B_C
// For a scalar whose derivative by n_c is the vector a_c, with a_b = R_c a_c, a_w = R_wb a_b (g^T [x]x = (g x x)^T):
//   p_wb: a_w x d                          theta_wb: a_b x n_b - (a_b x t_c) x d_b
//   t_c:  a_b x d_b                        theta_c:  a_c x n_c
//   n:    a_w                              d:        (p_wb - o + R_wb t_c) x a_w
// p additive in the outer frame, theta on the right.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "estimator/factors/plucker.h"

namespace plumbline::estimator {

struct LineChain {
  // p_wb relative to the line's origin.
  LineChain(const PluckerLine& line, const Eigen::Matrix3d& R_wb, const Eigen::Vector3d& p_wb,
            const Eigen::Matrix3d& R_bc, const Eigen::Vector3d& p_bc)
      : d(line.d), R_W_B(R_wb), p_W_B(p_wb), R_B_C(R_bc), p_B_C(p_bc) {
    n_b.noalias() = R_W_B.transpose() * (line.n - p_W_B.cross(d));
    d_b.noalias() = R_W_B.transpose() * d;
    n_c.noalias() = R_B_C.transpose() * (n_b - p_B_C.cross(d_b));
  }

  Eigen::Vector3d d;
  Eigen::Matrix3d R_W_B;
  Eigen::Vector3d p_W_B;
  Eigen::Matrix3d R_B_C;
  Eigen::Vector3d p_B_C;
  Eigen::Vector3d n_b;
  Eigen::Vector3d d_b;
  Eigen::Vector3d n_c;
};

// Derivatives (as column vectors) of a scalar whose derivative by n_c is a_c.
struct LineGradient {
  LineGradient(const LineChain& c, const Eigen::Vector3d& derivative_by_n_c)
      : a_c(derivative_by_n_c), a_b(c.R_B_C * a_c), a_w(c.R_W_B * a_b) {}

  Eigen::Vector3d body_position(const LineChain& c) const { return a_w.cross(c.d); }
  Eigen::Vector3d body_rotation(const LineChain& c) const { return a_b.cross(c.n_b) - a_b.cross(c.p_B_C).cross(c.d_b); }
  Eigen::Vector3d extrinsic_position(const LineChain& c) const { return a_b.cross(c.d_b); }
  Eigen::Vector3d extrinsic_rotation(const LineChain& c) const { return a_c.cross(c.n_c); }
  const Eigen::Vector3d& line_n() const { return a_w; }
  Eigen::Vector3d line_d(const LineChain& c) const { return (c.p_W_B + c.R_W_B * c.p_B_C).cross(a_w); }

  Eigen::Vector3d a_c;
  Eigen::Vector3d a_b;
  Eigen::Vector3d a_w;
};

}  // namespace plumbline::estimator
