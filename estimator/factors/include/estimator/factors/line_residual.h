// Distance of an observed end point from the image of a line, in pixels, and its derivative by n_c, the line's normal
// in the camera (plucker.h). With b = (x, y, 1) the bearing of the end point and D = d(x, y)/d(u, v) of the picture
// there,
//   r = n_c.b / m,   m = |D^T n_c,xy|            positive on the side to which n_c points
//   dr/dn_c = b_foot / m,   b_foot = b - D D^T n_c,xy (n_c.b)/m^2      the bearing of the foot of the perpendicular
// Without a lens D = diag(1/fx, 1/fy), and this is the text-book form  r = s^T l / sqrt(l1^2 + l2^2)  with the line
// l = Kl n_c, Kl = [fy 0 0; 0 fx 0; -fy cx, -fx cy, fx fy], s = (u, v, 1), and its derivative
//   dr/dl = [ u/m - l1 (s.l)/m^3, v/m - l2 (s.l)/m^3, 1/m ]
// (a form without l3 is in print; it is wrong but for lines through the image's origin). With a lens the picture is
// taken as linear about the observed pixel, over the length of the residual.
// r does not depend on the scale of n_c, but m does: derivatives belong to the n_c they were made with.
// He, Zhao, Guo, He, Yuan, "PL-VIO", Sensors 2018, eq. 19-21.
#pragma once

#include <array>

#include <Eigen/Core>

#include "core/camera.h"

namespace plumbline::estimator {

// What a factor keeps of an observed end point.
struct LineEndPoint {
  LineEndPoint(const core::PinholeCamera& camera, const Eigen::Vector2d& observed_px);

  Eigen::Vector2d pixel;
  Eigen::Vector3d b;
  Eigen::Matrix2d D;
};

// The two ends of an observed segment, in pixels. No correspondence between them and points of the line is supposed.
using SegmentPixels = std::array<Eigen::Vector2d, 2>;
std::array<LineEndPoint, 2> line_end_points(const core::PinholeCamera& camera, const SegmentPixels& observed);

// A line whose m is below this share of |n_c| |D| is as good as at infinity.
inline constexpr double kSmallestLineGradient = 1e-12;

struct LineDistance {
  double r_px = 0.0;
  Eigen::Vector3d dr_dn;
};

// False where the image of the line is at infinity or the line meets the centre of the camera (m = 0).
bool line_distance(const Eigen::Vector3d& n_c, const Eigen::Vector3d& b, const Eigen::Matrix2d& D, LineDistance& out);

}  // namespace plumbline::estimator
