// Where a rolling-shutter camera sees a point: the row and with it the time, the solution of
//   v = h_v(q(tau(v))),   tau(v) = (t_cam - s_k) + td + (v - rows/2)/rows * readout
// with the body at tau carried there by a path (timed_body.h, spline_path.h) and q the ray of point_chain.h. The row is
// the predicted one: a measured row is noisy, and its noise would enter the time.
//
// By the implicit function theorem, with q' = dq/dtau and k = (dh_v/dq) q' readout/rows,
//   dv/dx = (dh_v/dq)(dq/dx at fixed tau) / (1 - k)
//   dq/dx = M (dq/dx at fixed tau),   M = I + q' (dh_v/dq) (readout/rows) / (1 - k)
#pragma once

#include <Eigen/Core>

#include "core/camera.h"
#include "estimator/factors/point_chain.h"
#include "estimator/factors/spline_path.h"
#include "estimator/factors/timed_body.h"

namespace plumbline::estimator {

struct RollingShutter {
  double offset_s = 0.0;  // of the middle row from the path's origin, such as the state: t_cam - s_k + td
  double readout_s = 0.0;
};

struct RollingView {
  double phase = 0.0;  // (v - rows/2)/rows
  TimedBody body;      // at tau
  Eigen::Vector3d q_dot;
  Eigen::RowVector3d dv_dq;
  double s_per_row = 0.0;
  double slope = 1.0;  // 1 - k

  // dr/dq at the point's own row, from that at a fixed time.
  Matrix23 with_row(const Matrix23& dr_dq) const { return dr_dq + (dr_dq * q_dot) * (s_per_row / slope * dv_dq); }
};

// Takes W and lambda of the chain, sets X and q, and leaves the path at tau. Newton's method from first_row_px, such as
// the measured row. False where the point is not in front of the camera, the time leaves the path, or the point races
// the shutter, so that its row is not unique.
template <class Path>
bool view_point(const core::PinholeCamera& camera, const RollingShutter& shutter, const RigidMotion& T_B_C,
                double first_row_px, Path& path, PointChain& chain, RollingView& result);

extern template bool view_point(const core::PinholeCamera&, const RollingShutter&, const RigidMotion&, double,
                                BodyPath&, PointChain&, RollingView&);
extern template bool view_point(const core::PinholeCamera&, const RollingShutter&, const RigidMotion&, double,
                                SplinePath&, PointChain&, RollingView&);

}  // namespace plumbline::estimator
