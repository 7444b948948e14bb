#include "sim/scenario.h"

#include <cmath>

namespace plumbline::sim {

using core::any;
using core::at_least;
using core::non_negative;
using core::positive;
using core::probability;

// Argument-dependent lookup finds these; it does not look into an unnamed namespace.
static void visit(core::ConfigVisitor& v, HandheldConfig& c) {
  v.value("speed_rms_m_s", c.speed_rms_m_s, non_negative(), "root mean square speed");
  v.value("rate_rms_rad_s", c.rate_rms_rad_s, non_negative(),
          "root mean square angular rate; the peak is about 2.2 times");
  v.value("lowest_frequency_hz", c.lowest_frequency_hz, positive(), "lower end of the band of its sinusoids");
  v.value("highest_frequency_hz", c.highest_frequency_hz, positive(), "upper end");
}

static void visit(core::ConfigVisitor& v, LoopConfig& c) {
  v.value("radius_m", c.radius_m, positive(), "of the circle; half the length of the figure eight");
  v.value("height_amplitude_m", c.height_amplitude_m, non_negative(), "of the up and down, three times a loop");
  v.value("period_s", c.period_s, positive(), "of one loop");
}

static void visit(core::ConfigVisitor& v, TrajectoryConfig& c) {
  v.choice("type", c.type, kTrajectoryTypeNames, "kind of motion");
  v.section("handheld", c.handheld, "`handheld`: a random sum of sinusoids a seed");
  v.section("loop", c.loop, "`circle` and `figure_eight`: travelled with the body's x axis ahead");
  v.path("file", c.file, "`spline`: recorded poses T_W_B, TUM format");
  v.value("start_s", c.start_s, non_negative(), "`spline`: where in the file the recording starts");
  v.value("knot_interval_s", c.knot_interval_s, core::at_least(0.01),
          "`spline`: wider smooths more; interpolated measurement noise would fake excitation");
  v.value("largest_gap_s", c.largest_gap_s, positive(), "`spline`: a wider gap between poses is refused");
}

static void visit(core::ConfigVisitor& v, ImuConfig& c) {
  v.value("rate_hz", c.rate_hz, core::between(10.0, 10000.0), "samples a second");
  v.value("gyro_noise_density_rad_s_sqrt_hz", c.noise.gyro_noise_density, non_negative(),
          "white noise, continuous time");
  v.value("gyro_bias_walk_rad_s2_sqrt_hz", c.noise.gyro_bias_walk, non_negative(), "random walk of the bias");
  v.value("accel_noise_density_m_s2_sqrt_hz", c.noise.accel_noise_density, non_negative(),
          "white noise, continuous time");
  v.value("accel_bias_walk_m_s3_sqrt_hz", c.noise.accel_bias_walk, non_negative(), "random walk of the bias");
  v.value("gyro_bias_rad_s", c.gyro_bias_rad_s, any(), "true bias at the start, body axes");
  v.value("accel_bias_m_s2", c.accel_bias_m_s2, any(), "true bias at the start, body axes");
}

static void visit(core::ConfigVisitor& v, CameraConfig& c) {
  v.value("rate_hz", c.rate_hz, core::between(0.1, 1000.0), "frames a second");
  v.value("width_px", c.model.width_px, at_least(1), "columns");
  v.value("height_px", c.model.height_px, at_least(1), "rows");
  v.value("fx_px", c.model.fx_px, positive(), "focal length, horizontal");
  v.value("fy_px", c.model.fy_px, positive(), "focal length, vertical");
  v.value("cx_px", c.model.cx_px, any(), "principal point; (0, 0) is the centre of the upper left pixel");
  v.value("cy_px", c.model.cy_px, any(), "principal point");
  v.value("td_s", c.td_s, core::between(-1.0, 1.0), "time offset, t_imu = t_cam + td");
  v.choice("td_reference_row", c.td_reference_row, core::kRowReferenceNames, "the row that td_s speaks of");
  v.value("readout_s", c.readout_s, core::between(0.0, 1.0), "from the first row to the last; 0 is a global shutter");
  v.value("pixel_sigma_px", c.pixel_sigma_px, non_negative(), "Gaussian noise of u and v");
  v.value("extrinsic_position_m", c.extrinsic_position_m, any(), "p_B_C, the camera in the body");
  v.value("extrinsic_rotation_xyzw", c.extrinsic_rotation_xyzw, core::between(-1.0, 1.0),
          "R_B_C as a unit quaternion; the default looks along the body's x axis");
}

static void visit(core::ConfigVisitor& v, WorldConfig& c) {
  v.choice("type", c.type, kWorldTypeNames, "`shell`: about the path, in all directions");
  v.value("landmarks", c.landmarks, core::between(1, 1000000), "how many");
  v.value("nearest_m", c.nearest_m, positive(), "shortest distance from the place on the path that they surround");
  v.value("farthest_m", c.farthest_m, positive(), "longest distance from it");
}

static void visit(core::ConfigVisitor& v, PointsConfig& c) {
  v.value("per_frame", c.per_frame, core::between(0, 100000), "most points that a frame tracks");
  v.value("nearest_m", c.nearest_m, positive(), "smallest depth that is tracked");
  v.value("farthest_m", c.farthest_m, positive(), "largest depth that is tracked");
  v.value("loss_probability", c.loss_probability, probability(), "that a track ends at a frame");
  v.value("longest_track_frames", c.longest_track_frames, at_least(0), "a track ends after as many; 0 is no limit");
}

static void visit(core::ConfigVisitor& v, PriorConfig& c) {
  v.choice("means", c.means, kPriorMeansNames,
           "`drawn`: truth plus noise of the sigmas below; `truth`: exact, and no NEES is reported");
  v.choice("start", c.start, kPriorStartNames, "where the iteration starts: at the means, or at a draw of its own");
  v.value("td_mean_s", c.td_mean_s, core::between(-1.0, 1.0), "drawn",
          "td of the middle row; with a fixed value no NEES of td is reported");
  v.value("td_sigma_s", c.td_sigma_s, non_negative(), "of the time offset");
  v.value("readout_sigma_s", c.readout_sigma_s, non_negative(), "of the readout");
  v.value("extrinsic_position_sigma_m", c.extrinsic_position_sigma_m, non_negative(), "of p_B_C, each axis");
  v.value("extrinsic_rotation_sigma_rad", c.extrinsic_rotation_sigma_rad, non_negative(), "of R_B_C, each axis");
  v.value("position_sigma_m", c.position_sigma_m, positive(), "of the first state, each axis; fixes the gauge");
  v.value("orientation_sigma_rad", c.orientation_sigma_rad, positive(), "of the first state, each axis");
  v.value("velocity_sigma_m_s", c.velocity_sigma_m_s, positive(), "of the first state, each axis");
  v.value("gyro_bias_sigma_rad_s", c.gyro_bias_sigma_rad_s, positive(), "of the first state, each axis");
  v.value("accel_bias_sigma_m_s2", c.accel_bias_sigma_m_s2, positive(), "of the first state, each axis");
}

core::StateSigmas PriorConfig::state_sigmas() const {
  return {.position_m = position_sigma_m,
          .orientation_rad = orientation_sigma_rad,
          .velocity_m_s = velocity_sigma_m_s,
          .gyro_bias_rad_s = gyro_bias_sigma_rad_s,
          .accel_bias_m_s2 = accel_bias_sigma_m_s2};
}

core::CalibrationSigmas PriorConfig::calibration_sigmas() const {
  return {.td_s = td_sigma_s,
          .readout_s = readout_sigma_s,
          .extrinsic_position_m = extrinsic_position_sigma_m,
          .extrinsic_rotation_rad = extrinsic_rotation_sigma_rad};
}

core::RigCalibration ScenarioConfig::calibration() const {
  const Eigen::Quaterniond q(Eigen::Vector4d(camera.extrinsic_rotation_xyzw));
  return {.T_B_C = {q.normalized(), camera.extrinsic_position_m},
          .td_s = core::td_middle_from(camera.td_s, camera.readout_s, camera.td_reference_row),
          .readout_s = camera.readout_s};
}

void visit(core::ConfigVisitor& v, ScenarioConfig& c) {
  v.value("duration_s", c.duration_s, core::between(1.0, 3600.0), "of the recording, IMU clock");
  v.value("gravity_m_s2", c.gravity_m_s2, non_negative(), "along -z of the world");
  v.section("trajectory", c.trajectory, "how the body moves");
  v.section("imu", c.imu, "the inertial sensor");
  v.section("camera", c.camera, "the camera and how it is mounted");
  v.section("world", c.world, "the landmarks that there are");
  v.section("points", c.points, "the tracks of them");
  v.section("prior", c.prior, "what the estimator is told beforehand");
}

std::optional<core::RuleViolation> validate(const ScenarioConfig& c) {
  const auto& t = c.trajectory;
  if (std::abs(c.camera.extrinsic_rotation_xyzw.norm() - 1.0) > 1e-3) {
    return core::RuleViolation{"camera.extrinsic_rotation_xyzw", "must be a unit quaternion"};
  }
  if (t.handheld.highest_frequency_hz < t.handheld.lowest_frequency_hz) {
    return core::RuleViolation{"trajectory.handheld.highest_frequency_hz", "must be >= lowest_frequency_hz"};
  }
  if (t.type == TrajectoryType::kSpline && t.file.empty()) {
    return core::RuleViolation{"trajectory.file", "a spline needs a pose file"};
  }
  if (c.world.farthest_m < c.world.nearest_m) {
    return core::RuleViolation{"world.farthest_m", "must be >= nearest_m"};
  }
  if (c.points.farthest_m < c.points.nearest_m) {
    return core::RuleViolation{"points.farthest_m", "must be >= nearest_m"};
  }
  return std::nullopt;
}

}  // namespace plumbline::sim
