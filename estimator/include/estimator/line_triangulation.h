// A line's first value from two or more views of segments of it, the poses known roughly.
//
// With a rolling shutter each end of a segment has a camera pose of its own, so that a segment is two rays, not a
// plane. The anchor's two rays, c_k + a_k / rho_k with rho_k the inverse depths of its ends, leave the line two degrees
// of freedom. The ray (c, a) of any other end meets the line where
//   F = a . N,   N = (a_0 + rho_0 (c_0 - c)) x (a_1 + rho_1 (c_1 - c)) = 0
// N being the normal of the plane through c and the line. F is linear in rho_0 and rho_1 but for the way that the
// camera goes between the anchor's two ends, and F/m with m = |D^T (R^T N)_xy| is the end's distance from the line in
// pixels (factors/line_residual.h). Gauss-Newton from the line at infinity; a global shutter needs one step, and for
// two views this is the intersection of two planes.
//
// The homogeneous system a . (n - c x d) = 0 for all ends would be linear in the six coordinates, but two views leave
// it two solutions, and cameras on a straight path any number: the line through their centres lies in all planes.
//
// Then all ends, the anchor's too, by Gauss-Newton over the four degrees of freedom with the poses held.
#pragma once

#include <array>
#include <optional>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "core/camera.h"
#include "estimator/factors/orthonormal_line.h"
#include "estimator/triangulation.h"

namespace plumbline::estimator {

// The two ends, each from where the camera was when its row was exposed.
using SegmentView = std::array<View, 2>;

// Why there is no line yet, or none at all.
enum class LineDeferral {
  kNone,
  kTooFewViews,
  kNoDirection,  // a view sees a point: the ends fall together, or the line goes through the camera's centre
  kNoParallax,   // the planes of the views do not tell the depth: no baseline, the line in the epipolar plane, far away
  kOutOfRange,   // a depth of an end outside what is plausible
  kBehind,       // of a camera that saw it
};
inline constexpr std::array<std::string_view, 6> kLineDeferralNames = {"none",        "too few views", "no direction",
                                                                       "no parallax", "out of range",  "behind"};

struct LineStartRules {
  double sigma_px = 1.0;             // or what the residuals of three views or more tell, where that is more
  double largest_depth_sigma = 0.3;  // of rho_0 and rho_1, each as a share of itself
};

struct TriangulatedLine {
  std::optional<LineBlock> line;  // about the anchor's camera centre, at its first end
  Eigen::Vector3d origin_W = Eigen::Vector3d::Zero();
  LineDeferral deferral = LineDeferral::kNone;
};

// The first view is the anchor's. Pixels must be such that a ray falls on them.
TriangulatedLine triangulate_line(const core::PinholeCamera& camera, const std::vector<SegmentView>& views,
                                  const LineStartRules& rules);

// Whether what each end of the view saw of the line lies in front of the camera. L is about origin_W.
bool in_front(const core::PinholeCamera& camera, const SegmentView& view, const PluckerLine& L,
              const Eigen::Vector3d& origin_W);

}  // namespace plumbline::estimator
