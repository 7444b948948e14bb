// The factors of a point landmark as the configuration wants them: timing model, residual, form of the landmark.
#pragma once

#include <memory>
#include <optional>

#include <Eigen/Core>
#include <ceres/cost_function.h>

#include "estimator/config.h"
#include "estimator/factors/point_factors.h"

namespace plumbline::estimator {

// One observation of a landmark.
struct PointView {
  FrameTiming timing;
  Eigen::Vector2d pixel;
  std::optional<Eigen::Vector2d> velocity = std::nullopt;  // must be there for `feature_velocity`
};

// What all points share. The landmark of a point is (x, y, lambda), or lambda alone with `fixed_bearing`.
struct PointModel {
  CameraModel camera;
  TimingModel timing = TimingModel::kPropagated;
  LandmarkType landmark = LandmarkType::kBearingInverseDepth;
};

// Blocks: anchor state, observer state, extrinsics, td, readout, landmark.
std::unique_ptr<ceres::CostFunction> make_point_factor(const PointModel& model, const PointView& anchor,
                                                       const PointView& observer);

// The anchor's own observation; null where it is taken as exact. Blocks: td, readout (with `feature_velocity` only),
// landmark.
std::unique_ptr<ceres::CostFunction> make_anchor_factor(const PointModel& model, const PointView& anchor);

}  // namespace plumbline::estimator
