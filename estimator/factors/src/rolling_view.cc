#include "estimator/factors/rolling_view.h"

#include <cmath>

#include "core/calibration.h"

namespace plumbline::estimator {

template <class Path>
bool view_point(const core::PinholeCamera& camera, const RollingShutter& shutter, const RigidMotion& T_B_C,
                double first_row_px, Path& path, PointChain& chain, RollingView& result) {
  constexpr int kMaxIterations = 10;
  // A defect below this is made up for along q' only: what that neglects is of second order in the ray, and of relative
  // order 1e-11 in the derivatives.
  constexpr double kTolerancePx = 1e-7;
  constexpr double kSmallestSlope = 0.1;
  const int rows = camera.height_px;
  result.s_per_row = shutter.readout_s / rows;
  double row = first_row_px;
  for (int iteration = 0; iteration <= kMaxIterations; ++iteration) {
    if (!path.at(shutter.offset_s + core::row_phase(row, rows) * shutter.readout_s, result.body)) return false;
    chain.to_camera(T_B_C, result.body);
    Matrix23 J_pixel;
    const auto pixel = camera.project(chain.q, &J_pixel);
    if (!pixel) return false;
    const TimedBody& body = result.body;
    const Eigen::Vector3d X_dot = chain.X.cross(body.omega) - chain.lambda * (body.R.transpose() * body.velocity);
    result.q_dot.noalias() = T_B_C.R.transpose() * X_dot;
    result.dv_dq = J_pixel.row(1);
    result.slope = 1.0 - result.dv_dq.dot(result.q_dot) * result.s_per_row;
    if (result.slope < kSmallestSlope) return false;
    const double defect_px = pixel->y() - row;
    row += defect_px / result.slope;
    if (std::abs(defect_px) < kTolerancePx || shutter.readout_s == 0.0) {
      result.phase = core::row_phase(row, rows);
      chain.q += (result.s_per_row * defect_px / result.slope) * result.q_dot;
      return true;
    }
  }
  return false;
}

template bool view_point(const core::PinholeCamera&, const RollingShutter&, const RigidMotion&, double, BodyPath&,
                         PointChain&, RollingView&);
template bool view_point(const core::PinholeCamera&, const RollingShutter&, const RigidMotion&, double, SplinePath&,
                         PointChain&, RollingView&);

}  // namespace plumbline::estimator
