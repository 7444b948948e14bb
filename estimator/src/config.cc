#include "estimator/config.h"

#include "core/physical_ranges.h"

namespace plumbline::estimator {

using core::sigma_up_to;

// Argument-dependent lookup finds these; it does not look into an unnamed namespace.
static void visit(core::ConfigVisitor& v, ImuNoiseOverride& c) {
  const std::string_view absent = "scenario";
  const core::Range density = sigma_up_to(core::kMostNoiseDensity);
  v.value("gyro_noise_density_rad_s_sqrt_hz", c.gyro_noise_density, density, absent, "white noise it believes in");
  v.value("gyro_bias_walk_rad_s2_sqrt_hz", c.gyro_bias_walk, density, absent, "random walk it believes in");
  v.value("accel_noise_density_m_s2_sqrt_hz", c.accel_noise_density, density, absent, "white noise it believes in");
  v.value("accel_bias_walk_m_s3_sqrt_hz", c.accel_bias_walk, density, absent, "random walk it believes in");
}

static void visit(core::ConfigVisitor& v, EstimateWhat& c) {
  v.value("td", c.td, "the time offset");
  v.value("readout", c.readout, "the readout time");
  v.value("extrinsics", c.extrinsics, "T_B_C");
  v.value(
      "intrinsics", c.intrinsics,
      "fx, fy, cx and cy; only of `sliding_window` with points `bearing_inverse_depth`, `propagated` and `pinhole`");
}

static void visit(core::ConfigVisitor& v, LineRules& c) {
  v.value("largest_depth_sigma", c.largest_depth_sigma, core::positive(),
          "a line waits for more views while the inverse depth of either end is known worse than this share of itself");
  v.value("cull_sigma", c.cull_sigma, core::positive(),
          "a line is given up where a solution leaves an end further from it than this many sigmas");
}

static void visit(core::ConfigVisitor& v, SplineConfig& c) {
  v.value(
      "knot_spacing_s", c.knot_spacing_s, core::between(1e-3, 10.0), "motion",
      "at most; `motion`: as wide as leaves nothing but noise in the IMU's samples. Where residuals of the IMU exceed "
      "its noise at the solution, the knots of `motion` are doubled, and those that are given are a failed trial");
  v.value("order", c.order, core::between(4, 6), "of the B-spline: 6 is quintic");
}

static void visit(core::ConfigVisitor& v, WindowConfig& c) {
  v.value("keyframes", c.keyframes, core::at_least(3), "states that stay");
  v.value("kept_points", c.kept_points, core::at_least(0),
          "points that outlive the keyframe that they are tied to, at most; the others are estimated anew");
  v.value("freeze_td_sigma_s", c.freeze_td_sigma_s, core::positive(),
          "no keyframe leaves while td is known worse than this, since what leaves is linearised for good");
  v.value("start_keyframes", c.start_keyframes, core::at_least(3), "until then, so many stay at most");
  v.value("keyframe_parallax_px", c.keyframe_parallax_px, core::at_least(0.0),
          "the newest frame stays where points have moved by so much since the last that stayed, the camera's "
          "rotation and the pixels' noise taken out (median); else it is replaced by the next");
  v.value(
      "largest_depth_sigma", c.largest_depth_sigma, core::positive(),
      "a point leaves without a trace while its inverse depth is known worse than this share of itself: what it says "
      "of the motion would be as wrong as its depth");
  v.value("usual_depth_m", c.usual_depth_m, core::positive(),
          "until then its inverse depth is that of this depth, give or take as much");
  v.value("outlier_sigma", c.outlier_sigma, core::positive(),
          "an observation is given up where a solution leaves it further away than this many sigmas");
  v.value(
      "restarts", c.restarts, core::at_least(0),
      "how often it may begin anew after a failure, from the last state that fitted, carried on by the IMU; the metric "
      "`restarts` counts them");
}

static void visit(core::ConfigVisitor& v, FromScratchConfig& c) {
  v.value("longest_s", c.longest_s, core::between(0.5, 60.0), "of the newest pictures, those that it is made from");
  v.value("least_parallax_px", c.least_parallax_px, core::positive(),
          "between two of them, the best rotation taken out (median)");
  v.value("largest_scale_sigma", c.largest_scale_sigma, core::between(1e-4, 0.3),
          "it waits for more data while the scale is known worse than this share of itself");
  v.value("gyro_bias_sigma_rad_s", c.gyro_bias_sigma_rad_s, sigma_up_to(core::kMostRateRadS),
          "what is known of the bias beforehand: zero, give or take this");
  v.value("accel_bias_sigma_m_s2", c.accel_bias_sigma_m_s2, sigma_up_to(core::kMostAccelerationMS2), "likewise");
}

static void visit(core::ConfigVisitor& v, ExternalConfig& c) {
  v.path("command", c.command, "the program; what is in its file is part of what the runs are");
  v.value("arguments", c.arguments, "words between blanks, before `--dataset DIR --out DIR`");
  v.value("environment", c.environment, "NAME=VALUE between blanks, on top of what `plumbline` has itself");
  v.value("cpu_limit_s", c.cpu_limit_s, core::between(0.1, 1e6),
          "processor time, rounded up to whole seconds; on the wall ten times as long. Reaching it is a failed trial");
  v.value("memory_limit_mb", c.memory_limit_mb, core::between(0.0, 1e9), "address space; 0 is no limit");
}

void visit(core::ConfigVisitor& v, EstimatorConfig& c) {
  v.choice("type", c.type, kEstimatorTypeNames,
           "`batch`: full maximum a posteriori; `sliding_window`: online, each state from the data up to it; "
           "`initialisation`: that of `from_scratch` alone; `external`: another program");
  v.choice("use", c.use, kObservationUseNames, "which observations enter");
  v.choice(
      "timing", c.timing, kTimingModelNames,
      "camera timing; `propagated`: the pose at the observation's own time, by the IMU; `feature_velocity`: the "
      "observation moved along its image velocity (VINS-Mono); `spline`: the pose at the observation's own time on a "
      "cumulative B-spline, which the IMU's samples are measurements of (only of `batch`)");
  v.choice("residual", c.residual, kResidualTypeNames,
           "of a point; `pinhole`: pixels; `unit_sphere`: on the tangent plane of the observed bearing");
  v.choice("landmark", c.landmark, kLandmarkTypeNames,
           "`bearing_inverse_depth`: 3 dof; `fixed_bearing`: inverse depth only, the anchor's observation taken as "
           "exact, for comparison");
  v.choice(
      "initialisation", c.initialisation, kInitialisationNames,
      "`prior`: starts from the scenario's prior; `from_scratch`: takes of it what it says of the calibration, and "
      "finds the first states itself");
  v.choice("solver", c.solver, kSolverNames, "`schur`: our own normal equations; `ceres`: the reference, slower");
  v.value("keyframe_rate_hz", c.keyframe_rate_hz, core::positive_up_to(core::kMostFrequencyHz),
          "only keyframes' observations enter");
  v.value("pixel_sigma_px", c.pixel_sigma_px, sigma_up_to(core::kMostPixels), "scenario", "pixel noise it believes in");
  v.value("line_sigma_px", c.line_sigma_px, sigma_up_to(core::kMostPixels), "scenario",
          "pixel noise of the ends of segments it believes in; must be given where the scenario's is 0 and lines are "
          "used");
  v.choice("loss", c.loss, kRobustLossNames, "of points and lines; with one neither NEES nor efficiency is claimed");
  v.value("loss_scale", c.loss_scale, core::positive(), "the length of a whitened residual at which the loss sets in");
  v.value("state_td_s", c.state_td_s, core::within(core::kMostTimeOffsetS), "estimate",
          "td by which the states lie at the frames; `estimate`: the prior's, and anew where td has left it by 5 ms");
  v.section("imu", c.imu, "IMU noise it believes in; must be given where the scenario's is 0");
  v.section("estimate", c.estimate, "what is free; the rest is held at the prior's mean");
  v.section("lines", c.lines, "which lines are estimated");
  v.section("spline", c.spline, "of the timing `spline`");
  v.section("window", c.window, "of `sliding_window`");
  v.section("from_scratch", c.from_scratch, "of `initialisation: from_scratch`");
  v.section("external", c.external, "of `external`");
  v.value("max_iterations", c.max_iterations, core::at_least(1), "of each solve; reaching it is a failed trial");
  v.value("max_cost_per_dof", c.max_cost_per_dof, core::positive(),
          "a mean squared whitened residual above it is a false minimum: a failed trial");
}

BelievedNoise believed_noise(const EstimatorConfig& config, const core::ImuNoise& imu_noise, double pixel_sigma_px,
                             double line_sigma_px) {
  return {.imu = {.gyro_noise_density = config.imu.gyro_noise_density.value_or(imu_noise.gyro_noise_density),
                  .gyro_bias_walk = config.imu.gyro_bias_walk.value_or(imu_noise.gyro_bias_walk),
                  .accel_noise_density = config.imu.accel_noise_density.value_or(imu_noise.accel_noise_density),
                  .accel_bias_walk = config.imu.accel_bias_walk.value_or(imu_noise.accel_bias_walk)},
          .pixel_sigma_px = config.pixel_sigma_px.value_or(pixel_sigma_px),
          .line_sigma_px = config.line_sigma_px.value_or(line_sigma_px)};
}

}  // namespace plumbline::estimator
