#include "estimator/point_terms.h"

#include <stdexcept>

#include "estimator/factors/feature_velocity.h"

namespace plumbline::estimator {
namespace {

RayChart chart_of(const CameraModel& model, const PointView& view) {
  return {model.residual, model.camera, model.pixel_sigma_px, view.pixel};
}

MovingBearing moving(const CameraModel& model, const PointView& view) {
  if (!view.velocity) throw std::invalid_argument("feature_velocity: an observation without a velocity");
  return {model.camera, view.timing.offset_s, view.pixel, *view.velocity};
}

}  // namespace

std::unique_ptr<ceres::CostFunction> make_point_factor(const PointModel& model, const PointView& anchor,
                                                       const PointView& observer) {
  constexpr auto kBearing = LandmarkType::kBearingInverseDepth;
  constexpr auto kFixed = LandmarkType::kFixedBearing;
  const CameraModel& camera = model.camera;
  const bool fixed = model.landmark == kFixed;
  if (model.timing == TimingModel::kFeatureVelocity) {
    const RayChart chart = chart_of(camera, observer);
    const MovingBearing observed = moving(camera, observer);
    if (!fixed) return std::make_unique<FeatureVelocityPoint<kBearing>>(chart, observed);
    return std::make_unique<FeatureVelocityPoint<kFixed>>(chart, observed, moving(camera, anchor));
  }
  if (!fixed) {
    return std::make_unique<PropagatedPoint<kBearing>>(camera, anchor.timing, observer.timing, observer.pixel);
  }
  return std::make_unique<PropagatedPoint<kFixed>>(camera, anchor.timing, observer.timing, observer.pixel,
                                                   anchor.pixel);
}

std::unique_ptr<ceres::CostFunction> make_anchor_factor(const PointModel& model, const PointView& anchor) {
  if (model.landmark == LandmarkType::kFixedBearing) return nullptr;
  if (model.timing == TimingModel::kFeatureVelocity) {
    return std::make_unique<FeatureVelocityAnchor>(chart_of(model.camera, anchor), moving(model.camera, anchor));
  }
  return std::make_unique<AnchorPointFactor>(model.camera, anchor.pixel);
}

}  // namespace plumbline::estimator
