// The Cramer-Rao bound of a trial: no estimator that is locally unbiased, given these measurements and this prior, has
// a smaller covariance than
//   Sigma = ( P0^-1 + sum_i J_i^T J_i )^-1
// J_i the whitened Jacobians of all inertial and visual measurements at the true states, with the exact camera timing
// (`propagated`), points with three degrees of freedom, lines with four, without prior. Rates and accelerations in them
// are the true ones (noise_free_imu): with those of the noisy samples a rig at rest would seem to turn, and td to be
// seen. Since priors are drawn as one more measurement, this is the classical bound (Van Trees, 1968, section 2.4.2);
// the biases' walk is part of the measurement model.
//
// Landmarks are taken in world coordinates here, which any smooth choice of coordinates equals. Each track is a
// landmark of its own, as to an estimator that does not recognise places. A direction in which no observation moves
// a landmark (no parallax; a line that is seen from one plane only) is left out. Of a segment's ends only the distance
// from the line is measured, two rows an observation (estimator/factors/line_factors.h).
#pragma once

#include <vector>

#include <Eigen/Core>

#include "core/estimate.h"
#include "core/measurements.h"
#include "eval/aligned_bound.h"
#include "eval/alignment.h"
#include "sim/ground_truth.h"

namespace plumbline::eval {

// From the measurements up to the stamp.
struct CausalBound {
  core::TimeNs t_ns = 0;  // of the state, IMU clock
  core::PosteriorCovariance covariance = core::PosteriorCovariance::Zero();
};

struct CramerRaoBound {
  // Of the calibration and the last state, in the order of core/estimate.h; rows of what is not free are zero.
  core::PosteriorCovariance covariance = core::PosteriorCovariance::Zero();
  std::vector<core::TimeNs> t_ns;     // of the states: the prior's and one a frame
  std::vector<PoseCovariance> poses;  // likewise, from all measurements
  AlignedBound ate;
  std::vector<CausalBound> causal;  // one a frame, if asked for
  // (sigma_g f)^2 |tau| M / sigma_px^2, mean over the observations, of points and of lines added: the share of the
  // gyroscope's noise within the gap between a state and its observations, which the model neglects. The bound is
  // trusted up to kLargestKappa2.
  double kappa2 = 0.0;
};

inline constexpr double kLargestKappa2 = 0.05;

struct BoundOptions {
  std::vector<std::size_t> frames;  // those whose observations are used, indices into the log, increasing
  bool td = true;                   // what is free
  bool readout = true;
  bool extrinsics = true;
  bool intrinsics = false;
  bool points = true;  // what is observed
  bool lines = true;
  Alignment alignment = Alignment::kPosyaw;  // by all poses
  bool causal = false;
};

// What the IMU would have measured at the stamps of the log without white noise and defects, the true biases included:
// central differences of the true orientations and velocities at the neighbouring stamps, exact to second order; at the
// two ends, where there is one neighbour, to first.
std::vector<core::ImuSample> noise_free_imu(const core::MeasurementLog& log, const sim::GroundTruth& truth);

// Needs positive noise densities and pixel noise of what is observed. Throws std::domain_error where the information is
// singular, and where the intrinsics are free and there are lines.
CramerRaoBound cramer_rao_bound(const core::MeasurementLog& log, const sim::GroundTruth& truth,
                                const BoundOptions& options);

}  // namespace plumbline::eval
