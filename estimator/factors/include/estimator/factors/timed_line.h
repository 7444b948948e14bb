// An observed end of a segment at its own row time, seen by a rolling-shutter camera with a time offset, whatever
// carries the body there: an end point of row v is exposed at
//   t(v) = offset + td + (v - rows/2)/rows readout
// on a path whose times count from its own origin, and sees the line from the body's pose then. All that the line may
// be seen at is the curve
//   F(u, v) = n_c(t(v)) . b(u, v) = 0
// and r is the signed distance of the observed end point from it: along grad F, at the foot of the perpendicular.
//
// The row is that of the foot, not the observed one. What of the pixel's noise lies across the curve is the residual;
// were it in the time as well, it would be in the derivatives by td and readout, correlated with the residual, and bias
// both. The noise along the curve cannot be told from the unknown place of the end on the line, and is independent of
// the residual. Since r is a distance along the normal of the true curve (the chord's normal turned by the flow), it
// has the pixel's variance exactly to first order. And by the envelope theorem
//   dr/dx = (dF/dx at the foot, held fixed) / |grad F|,   grad F = D^T n_c,xy + (0, dF/dt readout/rows)
#pragma once

#include <Eigen/Core>

#include "estimator/factors/line_chain.h"
#include "estimator/factors/line_jacobians.h"
#include "estimator/factors/line_residual.h"
#include "estimator/factors/timed_point.h"

namespace plumbline::estimator {

// Where an end is seen, whitened, and its derivatives on the tangent spaces; of the body at that time.
struct TimedEnd {
  double residual = 0.0;
  Eigen::Vector2d offset_px = Eigen::Vector2d::Zero();  // foot - observed
  Eigen::Vector3d body_position;
  Eigen::Vector3d body_rotation;
  Eigen::Vector3d extrinsic_position;
  Eigen::Vector3d extrinsic_rotation;
  double td = 0.0;
  double readout = 0.0;
  Eigen::RowVector4d line;
};

class TimedLine {
 public:
  TimedLine(const CameraModel& model, const Eigen::Vector3d& origin_W, const SegmentPixels& observed)
      : rows_(model.camera.height_px),
        pixel_sigma_px_(model.pixel_sigma_px),
        origin_W_(origin_W),
        ends_(line_end_points(model.camera, observed)) {}

  const LineEndPoint& end(std::size_t k) const { return ends_[k]; }

  // Leaves the path at the foot's time. False where the image is at infinity, the path has no pose, or the line moves
  // with the shutter, so that the curve has no normal.
  template <class Path>
  bool see(std::size_t k, const TimedRig& rig, const OrthonormalLine& line, Path& path, double offset_s,
           TimedEnd& seen) const;

  // Those of extrinsics, td, readout and line, where they are wanted, from block `first` on.
  static void write_shared(const TimedEnd& seen, const TimedRig& rig, const OrthonormalLine& line, const LineRows& rows,
                           int first, int k);

 private:
  int rows_;
  double pixel_sigma_px_;
  Eigen::Vector3d origin_W_;
  std::array<LineEndPoint, 2> ends_;
};

}  // namespace plumbline::estimator
