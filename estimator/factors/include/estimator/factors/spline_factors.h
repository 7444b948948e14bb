// What a trajectory spline (spline_path.h) is fitted to. Blocks: the controls that a factor's segment or segments need,
// each once and in order, then
//   SplinePoint     extrinsics, td, readout, landmark: the law of timed_point.h
//   SplineLine      extrinsics, td, readout, line: that of timed_line.h
//   SplineImu       two biases [ b_g | b_a ]: a sample as a direct measurement,
//                     r = [ (omega + b_g - w_m)/sigma_g ; (R^T (p'' - g) + b_a - a_m)/sigma_a ],   g = (0, 0, -gravity)
//                     sigma = density/sqrt(dt), b linear between its two values
//   SplineState     two biases: the prior of a state at its instant (prior_factors.h)
// and without controls
//   BiasWalk        two biases: r = (b_1 - b_0)/(sigma_b sqrt(T))
// Furgale, Rehder, Siegwart, "Unified temporal and spatial calibration for multi-sensor systems", IROS 2013.
#pragma once

#include <array>
#include <vector>

#include <ceres/cost_function.h>
#include <ceres/sized_cost_function.h>

#include "core/calibration.h"
#include "core/measurements.h"
#include "estimator/factors/prior_factors.h"
#include "estimator/factors/spline_path.h"
#include "estimator/factors/timed_line.h"
#include "estimator/factors/timed_point.h"

namespace plumbline::estimator {

inline constexpr int kBiasSize = 6;
using BiasBlock = Eigen::Matrix<double, kBiasSize, 1>;  // [ b_g | b_a ]

// An instant on a spline, and its bias b = (1 - share) b_i + share b_{i+1}.
struct SplineInstant {
  double t_s = 0.0;
  int segment = 0;
  int bias = 0;  // i
  double bias_share = 0.0;
};

// The controls of two segments, each once: of blocks [0, size), those of segment k begin at from[k].
struct SegmentPair {
  SegmentPair(const SplineKnots& knots, const std::array<int, 2>& segments);
  std::vector<int> controls() const;  // of the spline

  std::array<int, 2> segments;
  std::array<int, 2> from;
  int order;
  int size;
};

// A factor of two ends, each on a segment of its own, with a frame whose time since the spline's origin is t_cam.
class SplineVisual : public ceres::CostFunction {
 public:
  struct End {
    double t_cam_s = 0.0;
    int segment = 0;
  };
  std::vector<int> controls() const { return pair_.controls(); }

 protected:
  SplineVisual(const SplineKnots& knots, const std::array<End, 2>& ends, int landmark_size);
  SplinePath path(double const* const* parameters, std::size_t end) const {
    return {knots_, ends_[end].segment, parameters + pair_.from[end]};
  }
  // The sum of what the two ends have to say of the controls.
  void write_controls(const std::array<SplinePath::ControlRows<2>, 2>& rows, double const* const* parameters,
                      double** jacobians) const;
  bool wants_controls(double** jacobians) const;

  SplineKnots knots_;
  std::array<End, 2> ends_;
  SegmentPair pair_;
};

template <LandmarkType kLandmark>
class SplinePoint final : public SplineVisual {
 public:
  // `anchor_pixel`, with a fixed bearing: as observed.
  template <class... AnchorPixel>
  SplinePoint(const CameraModel& model, const SplineKnots& knots, const End& anchor, const End& observer,
              const Eigen::Vector2d& observed_pixel, const AnchorPixel&... anchor_pixel)
      : SplineVisual(knots, {anchor, observer}, landmark_size(kLandmark)),
        law_(model, observed_pixel, anchor_pixel...) {}

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override;

 private:
  TimedPoint<kLandmark> law_;
};

extern template class SplinePoint<LandmarkType::kBearingInverseDepth>;
extern template class SplinePoint<LandmarkType::kFixedBearing>;

class SplineLine final : public SplineVisual {
 public:
  SplineLine(const CameraModel& model, const SplineKnots& knots, const std::array<End, 2>& ends,
             const Eigen::Vector3d& origin_W, const SegmentPixels& observed)
      : SplineVisual(knots, ends, kLineSize), law_(model, origin_W, observed) {}

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override;

 private:
  TimedLine law_;
};

class SplineImu final : public ceres::CostFunction {
 public:
  SplineImu(const SplineKnots& knots, const SplineInstant& at, const core::ImuSample& sample,
            const core::ImuNoise& noise, double dt_s, double gravity_m_s2);

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override;

 private:
  SplineKnots knots_;
  SplineInstant at_;
  core::ImuSample sample_;
  double gyro_weight_;
  double accel_weight_;
  Eigen::Vector3d gravity_W_;
};

class SplineState final : public ceres::CostFunction {
 public:
  SplineState(const SplineKnots& knots, const SplineInstant& at, const core::State& mean,
              const core::StateSigmas& sigma);

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override;

 private:
  SplineKnots knots_;
  SplineInstant at_;
  StatePriorFactor prior_;
};

// Of the blocks of SplineState.
core::State spline_state(const SplineKnots& knots, const SplineInstant& at, double const* const* blocks);

class BiasWalk final : public ceres::SizedCostFunction<kBiasSize, kBiasSize, kBiasSize> {
 public:
  BiasWalk(const core::ImuNoise& noise, double interval_s);

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override;

 private:
  BiasBlock weights_;
};

}  // namespace plumbline::estimator
