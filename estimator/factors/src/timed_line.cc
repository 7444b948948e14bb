#include "estimator/factors/timed_line.h"

#include <cmath>

#include "core/calibration.h"
#include "estimator/factors/spline_path.h"

namespace plumbline::estimator {
namespace {

Eigen::Vector3d bearing_at(const LineEndPoint& end, const Eigen::Vector2d& offset_px) {
  Eigen::Vector3d b = end.b;
  b.head<2>() += end.D * offset_px;
  return b;
}

double rate_along(const LineGradient& gradient, const LineChain& chain, const TimedBody& body) {
  return gradient.body_position(chain).dot(body.velocity) + gradient.body_rotation(chain).dot(body.omega);
}

}  // namespace

// A step goes to the body at the time of the present foot's row, and to the foot on the curve's tangent there. It
// shrinks the error of the foot by the turn of the normal over the residual, 1e-4 a pixel: three steps for the
// residuals of noise. The tolerance is a time of 1e-12 s.
template <class Path>
bool TimedLine::see(std::size_t k, const TimedRig& rig, const OrthonormalLine& line, Path& path, double offset_s,
                    TimedEnd& seen) const {
  constexpr int kMaxIterations = 10;
  constexpr double kTolerancePx = 1e-8;
  const LineEndPoint& end = ends_[k];
  const PluckerLine L = line.plucker();
  seen.offset_px.setZero();
  for (int iteration = 0; iteration < kMaxIterations; ++iteration) {
    TimedBody body;
    const double phase = core::row_phase(end.pixel.y() + seen.offset_px.y(), rows_);
    if (!path.at(offset_s + rig.td_s + phase * rig.readout_s, body)) return false;
    const LineChain chain(L, body.R, body.p - origin_W_, rig.T_B_C.R, rig.T_B_C.p);
    const Eigen::Vector3d b = bearing_at(end, seen.offset_px);
    const double F_t = rate_along(LineGradient(chain, b), chain, body);
    const Eigen::Vector2d chord = end.D.transpose() * chain.n_c.head<2>();
    const Eigen::Vector2d normal = chord + Eigen::Vector2d(0.0, F_t * rig.readout_s / rows_);  // grad F
    const double length = normal.norm();
    // Below a tenth the line races the shutter, and its curve has no normal to speak of.
    if (!(chord.norm() > kSmallestLineGradient * chain.n_c.norm() * end.D.norm()) || !(length > 0.1 * chord.norm())) {
      return false;
    }
    const double distance_px = (chain.n_c.dot(b) - normal.dot(seen.offset_px)) / length;
    if (!std::isfinite(distance_px)) return false;
    const Eigen::Vector2d offset_px = normal * (-distance_px / length);
    const double moved_px = std::abs(offset_px.y() - seen.offset_px.y());
    seen.offset_px = offset_px;
    if (!(moved_px < kTolerancePx) && rig.readout_s != 0.0) continue;

    const LineGradient gradient(chain, bearing_at(end, offset_px) / (length * pixel_sigma_px_));
    seen.residual = distance_px / pixel_sigma_px_;
    seen.body_position = gradient.body_position(chain);
    seen.body_rotation = gradient.body_rotation(chain);
    seen.extrinsic_position = gradient.extrinsic_position(chain);
    seen.extrinsic_rotation = gradient.extrinsic_rotation(chain);
    seen.td = rate_along(gradient, chain, body);
    seen.readout = core::row_phase(end.pixel.y() + offset_px.y(), rows_) * seen.td;
    seen.line = line.to_tangent(gradient.line_n(), gradient.line_d(chain));
    return true;
  }
  return false;
}

template bool TimedLine::see(std::size_t, const TimedRig&, const OrthonormalLine&, BodyPath&, double, TimedEnd&) const;
template bool TimedLine::see(std::size_t, const TimedRig&, const OrthonormalLine&, SplinePath&, double,
                             TimedEnd&) const;

void TimedLine::write_shared(const TimedEnd& seen, const TimedRig& rig, const OrthonormalLine& line,
                             const LineRows& rows, int first, int k) {
  write_pose_row(seen.extrinsic_position, seen.extrinsic_rotation, rig.extrinsics.q, rows.row(first, kPoseSize, k));
  write_scalar(seen.td, rows.row(first + 1, 1, k));
  write_scalar(seen.readout, rows.row(first + 2, 1, k));
  if (double* const out = rows.row(first + 3, kLineSize, k)) line.write_row(seen.line, out);
}

}  // namespace plumbline::estimator
