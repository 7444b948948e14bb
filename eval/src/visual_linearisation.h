// The visual measurements of a recording, linearised about the truth: what the bound (eval/cramer_rao.h) is made of.
// A point is a variable of three degrees of freedom in world coordinates, a line one of four: the tangent of the
// orthonormal form of the true line about an origin, the true camera centre at the first state that sees it
// (estimator/factors/orthonormal_line.h). The Jacobians of a line are those of PropagatedLineFactor at the ends without
// their noise across the line, the feet of the perpendiculars from the measured ones. Each end gives one row.
#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Core>

#include "core/measurements.h"
#include "core/state.h"
#include "eval/cramer_rao.h"
#include "sim/ground_truth.h"

namespace plumbline::eval {

inline constexpr int kCalibrationDof = 12;  // T_B_C, td, readout, intrinsics

struct VisualObservation {
  int track = 0;
  Eigen::Matrix<double, 2, core::kStateDof> state;
  Eigen::Matrix<double, 2, kCalibrationDof> calibration;
  Eigen::MatrixXd landmark;  // on the observed directions
};

// Points and lines alike.
struct VisualTrack {
  std::size_t last_frame = 0;  // index into the options' frames
  // Of the directions that its observations move, all else known, scaled so that the information on them is the
  // identity. 0 where it has no more rows than degrees of freedom, a point that is seen once or a line that is seen
  // twice: they are spent on itself.
  int dof = 0;
};

// Times between states and the exposures that are assigned to them.
struct VisualGaps {
  double sum_s = 0.0;
  int observations = 0;
};

struct VisualLinearisation {
  std::vector<std::vector<VisualObservation>> frames;  // points, then lines
  std::vector<VisualTrack> tracks;
  VisualGaps point_gaps;
  VisualGaps line_gaps;
};

// The true states: state k + 1 is that of frame k, at log.imu[samples[k + 1]].
struct TrueMotion {
  const std::vector<core::ImuSample>& imu;  // without noise
  const std::vector<std::size_t>& samples;
  const std::vector<core::State>& states;
};

// Throws std::domain_error where there are lines and log.line_sigma_px is not positive.
VisualLinearisation linearise_visual(const core::MeasurementLog& log, const sim::GroundTruth& truth,
                                     const BoundOptions& options, const TrueMotion& motion);

}  // namespace plumbline::eval
