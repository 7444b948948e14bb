// The longest piece of a segment that a frame shows, without noise.
//   seen(s)  the point at(s) of the segment, exposed with its own row (sim/frame_view.h), lies in the picture and in
//            the range of depth, and no wall hides it
//   piece    seen on all of [s_0, s_1]; each s_k is an end of the segment, or a border of what is seen to 1e-9 px in
//            the picture, 1e-9 m in depth, 1e-10 of the segment's length at a wall
// The picture of the segment is a curve, since its rows are exposed one after another and the lens bends it; the two
// ends are those of its chord.
#pragma once

#include <array>
#include <optional>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "sim/frame_view.h"
#include "sim/segment.h"
#include "sim/world.h"

namespace plumbline::sim {

struct PieceEnd {
  double s = 0.0;
  Exposure exposure;
};

struct VisiblePiece {
  std::array<PieceEnd, 2> ends;  // in the order of the segment's own

  double length_px() const { return (ends[1].exposure.pixel - ends[0].exposure.pixel).norm(); }
};

// The place of a piece that divides its picture as `share` does, were the shutter global.
double at_image_share(const VisiblePiece& piece, double share);

class SegmentSight {
 public:
  SegmentSight(const World& world, const core::PinholeCamera& camera, double nearest_m, double farthest_m);

  std::optional<Exposure> sees(const FrameView& view, const Eigen::Vector3d& P_W) const;

  // Pieces are looked for at a dozen places, evenly spaced in the picture; one that lies between two of them, as behind
  // a slit, is not found.
  std::optional<VisiblePiece> longest_visible(const FrameView& view, const Segment& segment) const;

 private:
  struct Search;  // of a segment in a frame

  bool inside(const Exposure& exposure) const;

  const World& world_;
  const core::PinholeCamera& camera_;
  double nearest_m_;
  double farthest_m_;
  Eigen::AlignedBox2d bounds_;  // of the normalised coordinates that the picture shows, with a margin
};

}  // namespace plumbline::sim
