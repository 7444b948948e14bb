// The factor of an observed segment as the configuration wants it.
#pragma once

#include <memory>
#include <optional>

#include <Eigen/Core>
#include <ceres/cost_function.h>

#include "estimator/config.h"
#include "estimator/factors/line_factors.h"

namespace plumbline::estimator {

// One observation of a line.
struct LineView {
  FrameTiming timing;
  SegmentPixels ends_px;
  std::optional<SegmentVelocities> velocities = std::nullopt;  // must be there for `feature_velocity`
};

// What all lines share; the camera's pixel_sigma_px is that of the ends of segments.
struct LineModel {
  CameraModel camera;
  TimingModel timing = TimingModel::kPropagated;
};

// Blocks: state, extrinsics, td, readout, line about origin_W.
std::unique_ptr<ceres::CostFunction> make_line_factor(const LineModel& model, const LineView& view,
                                                      const Eigen::Vector3d& origin_W);

}  // namespace plumbline::estimator
