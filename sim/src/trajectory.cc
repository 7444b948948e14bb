#include "sim/trajectory.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "sim/constant_motion.h"
#include "sim/handheld_motion.h"
#include "sim/harmonic_trajectory.h"
#include "sim/loop_motion.h"
#include "sim/sine3d_motion.h"
#include "sim/spline_fit.h"

namespace plumbline::sim {

namespace {

using core::TrialId;
using Config = TrajectoryConfig;
using Made = std::unique_ptr<const Trajectory>;

Made harmonic(HarmonicTrajectory::Shape shape) { return std::make_unique<HarmonicTrajectory>(std::move(shape)); }

Made constant(const ConstantMotion::Parameters& parameters) { return std::make_unique<ConstantMotion>(parameters); }

core::PoseFile read_file(const Config& c) {
  return core::read_poses(c.file, {.format = c.format, .kitti_rate_hz = c.pose_rate_hz});
}

Made spline(const Config& c, double duration_s) {
  return std::make_unique<SplineTrajectory>(fit_spline(read_file(c).poses, c, duration_s).trajectory);
}

struct Entry {
  TrajectoryType type;
  Made (*make)(const Config& c, double duration_s, TrialId id);
};

// clang-format off
constexpr std::array<Entry, kTrajectoryTypeNames.size()> kRegistry = {{
    {TrajectoryType::kHandheld, [](const Config& c, double, TrialId id) { return harmonic(handheld_shape(c.handheld, id)); }},
    {TrajectoryType::kPlanar, [](const Config& c, double, TrialId id) { return harmonic(planar_shape(c.handheld, id)); }},
    {TrajectoryType::kOneAxis, [](const Config& c, double, TrialId id) { return harmonic(one_axis_shape(c.handheld, c.rotation_axis, id)); }},
    {TrajectoryType::kPureTranslation, [](const Config& c, double, TrialId id) { return harmonic(pure_translation_shape(c.handheld, id)); }},
    {TrajectoryType::kPureRotation, [](const Config& c, double, TrialId id) { return harmonic(pure_rotation_shape(c.handheld, id)); }},
    {TrajectoryType::kStatic, [](const Config&, double, TrialId) { return constant({}); }},
    {TrajectoryType::kConstantTwist, [](const Config& c, double, TrialId) { return constant(constant_twist(c.constant)); }},
    {TrajectoryType::kConstantAcceleration, [](const Config& c, double, TrialId) { return constant(constant_acceleration(c.constant)); }},
    {TrajectoryType::kCircle, [](const Config& c, double, TrialId) { return harmonic(circle_shape(c.loop)); }},
    {TrajectoryType::kWavyCircle, [](const Config& c, double, TrialId) { return harmonic(wavy_circle_shape(c.loop)); }},
    {TrajectoryType::kFigureEight, [](const Config& c, double, TrialId) { return harmonic(figure_eight_shape(c.loop)); }},
    {TrajectoryType::kBall, [](const Config& c, double, TrialId) { return harmonic(ball_shape(c.loop)); }},
    {TrajectoryType::kTorus, [](const Config& c, double, TrialId) { return harmonic(torus_shape(c.loop)); }},
    {TrajectoryType::kSine3d, [](const Config& c, double, TrialId) { return harmonic(sine3d_shape(c.sine3d)); }},
    {TrajectoryType::kSinusoids, [](const Config& c, double, TrialId) { return harmonic(sinusoids_shape(c.sinusoids)); }},
    {TrajectoryType::kSpline, [](const Config& c, double duration_s, TrialId) { return spline(c, duration_s); }},
}};
// clang-format on

}  // namespace

std::unique_ptr<const Trajectory> make_trajectory(const TrajectoryConfig& config, double duration_s, core::TrialId id) {
  const auto entry =
      std::find_if(kRegistry.begin(), kRegistry.end(), [&](const Entry& e) { return e.type == config.type; });
  if (entry == kRegistry.end()) throw std::logic_error("make_trajectory: unknown type");
  return entry->make(config, duration_s, id);
}

std::optional<SplineReport> spline_report(const TrajectoryConfig& config, double duration_s) {
  if (config.type != TrajectoryType::kSpline) return std::nullopt;
  const core::PoseFile file = read_file(config);
  const SplineFit fit = fit_spline(file.poses, config, duration_s);
  return SplineReport{
      .format = file.format, .from_s = fit.span.from_s, .to_s = fit.span.to_s, .residuals = fit.residuals};
}

MotionStrength motion_strength(const Trajectory& trajectory, double duration_s) {
  constexpr double kStepS = 0.01;
  const int n = std::max(1, static_cast<int>(duration_s / kStepS));
  MotionStrength m;
  for (int i = 0; i < n; ++i) {
    const Kinematics k = trajectory.at((i + 0.5) * duration_s / n);
    m.path_m += k.v_W.norm() * duration_s / n;
    m.speed_rms_m_s += k.v_W.squaredNorm();
    m.acceleration_rms_m_s2 += k.a_W.squaredNorm();
    m.rate_rms_rad_s += k.omega_B.squaredNorm();
    m.rate_peak_rad_s = std::max(m.rate_peak_rad_s, k.omega_B.norm());
    m.angular_acceleration_rms_rad_s2 += k.alpha_B.squaredNorm();
  }
  for (double* rms :
       {&m.speed_rms_m_s, &m.acceleration_rms_m_s2, &m.rate_rms_rad_s, &m.angular_acceleration_rms_rad_s2}) {
    *rms = std::sqrt(*rms / n);
  }
  return m;
}

}  // namespace plumbline::sim
