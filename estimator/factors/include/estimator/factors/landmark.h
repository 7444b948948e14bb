// What is estimated of a point landmark, in the camera of its anchor, the first frame that sees it.
//   bearing_inverse_depth   (x, y, lambda): bearing (x, y, 1) and inverse depth; the anchor's own observation is a
//                           residual like any other. The form for consistency and bounds.
//   fixed_bearing           (lambda): the anchor's noisy observation is taken as exact. Its noise then sits in every
//                           residual of the track, so that they are correlated: for comparison only.
#pragma once

#include <array>
#include <string_view>

namespace plumbline::estimator {

enum class LandmarkType { kBearingInverseDepth, kFixedBearing };
inline constexpr std::array<std::string_view, 2> kLandmarkTypeNames = {"bearing_inverse_depth", "fixed_bearing"};

constexpr int landmark_size(LandmarkType type) { return type == LandmarkType::kBearingInverseDepth ? 3 : 1; }

}  // namespace plumbline::estimator
