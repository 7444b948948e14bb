#include "sim/trajectory.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "core/pose_file.h"
#include "sim/harmonic_trajectory.h"
#include "sim/spline_trajectory.h"

namespace plumbline::sim {

std::unique_ptr<const Trajectory> make_trajectory(const TrajectoryConfig& config, double duration_s, core::TrialId id) {
  switch (config.type) {
    case TrajectoryType::kHandheld:
      return std::make_unique<HarmonicTrajectory>(handheld_shape(config.handheld, id));
    case TrajectoryType::kFigureEight:
      return std::make_unique<HarmonicTrajectory>(figure_eight_shape(config.loop));
    case TrajectoryType::kCircle:
      return std::make_unique<HarmonicTrajectory>(circle_shape(config.loop));
    case TrajectoryType::kSpline:
      return std::make_unique<SplineTrajectory>(fit_spline(core::read_tum(config.file), config, duration_s).trajectory);
  }
  throw std::logic_error("make_trajectory: unknown type");
}

std::optional<FitResiduals> fit_residuals(const TrajectoryConfig& config, double duration_s) {
  if (config.type != TrajectoryType::kSpline) return std::nullopt;
  return fit_spline(core::read_tum(config.file), config, duration_s).residuals;
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
