#include "sim/harmonic_trajectory.h"

#include <cmath>
#include <numbers>

namespace plumbline::sim {
namespace {

constexpr double kTwoPi = 2.0 * std::numbers::pi;

// atan2(dy/dt, dx/dt) and its first two derivatives.
std::array<double, 3> heading(const std::array<double, 4>& x, const std::array<double, 4>& y) {
  const double speed2 = x[1] * x[1] + y[1] * y[1];
  const double cross1 = x[1] * y[2] - y[1] * x[2];
  const double cross2 = x[1] * y[3] - y[1] * x[3];
  const double dot1 = x[1] * x[2] + y[1] * y[2];
  const double rate = cross1 / speed2;
  return {std::atan2(y[1], x[1]), rate, (cross2 - 2.0 * rate * dot1) / speed2};
}

Eigen::Quaterniond from_euler(double yaw, double pitch, double roll) {
  return Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()) * Eigen::AngleAxisd(pitch, Eigen::Vector3d::UnitY()) *
         Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitX());
}

}  // namespace

std::array<double, 4> SinusoidSum::derivatives(double t_s) const {
  std::array<double, 4> d = {offset, 0.0, 0.0, 0.0};
  for (const Term& term : terms) {
    const double angle = term.omega_rad_s * t_s + term.phase_rad;
    const double s = term.amplitude * std::sin(angle);
    const double c = term.amplitude * std::cos(angle);
    const double w = term.omega_rad_s;
    d[0] += s;
    d[1] += w * c;
    d[2] -= w * w * s;
    d[3] -= w * w * w * c;
  }
  return d;
}

double SinusoidSum::value(double t_s) const {
  double x = offset;
  for (const Term& term : terms) x += term.amplitude * std::sin(term.omega_rad_s * t_s + term.phase_rad);
  return x;
}

Kinematics HarmonicTrajectory::at(double t_s) const {
  const auto x = shape_.position[0].derivatives(t_s);
  const auto y = shape_.position[1].derivatives(t_s);
  const auto z = shape_.position[2].derivatives(t_s);
  const auto pitch = shape_.pitch.derivatives(t_s);
  const auto roll = shape_.roll.derivatives(t_s);
  std::array<double, 3> yaw{};
  if (shape_.yaw_follows_path) {
    yaw = heading(x, y);
  } else {
    const auto d = shape_.yaw.derivatives(t_s);
    yaw = {d[0], d[1], d[2]};
  }

  // Body rate of Z-Y-X angles, and its derivative.
  const double sp = std::sin(pitch[0]);
  const double cp = std::cos(pitch[0]);
  const double sr = std::sin(roll[0]);
  const double cr = std::cos(roll[0]);
  const Eigen::Vector3d omega(roll[1] - yaw[1] * sp,             //
                              pitch[1] * cr + yaw[1] * sr * cp,  //
                              -pitch[1] * sr + yaw[1] * cr * cp);
  const Eigen::Vector3d alpha(
      roll[2] - yaw[2] * sp - yaw[1] * cp * pitch[1],
      pitch[2] * cr - pitch[1] * sr * roll[1] + yaw[2] * sr * cp + yaw[1] * (cr * roll[1] * cp - sr * sp * pitch[1]),
      -pitch[2] * sr - pitch[1] * cr * roll[1] + yaw[2] * cr * cp - yaw[1] * (sr * roll[1] * cp + cr * sp * pitch[1]));

  return {.T_W_B = {from_euler(yaw[0], pitch[0], roll[0]), {x[0], y[0], z[0]}},
          .v_W = {x[1], y[1], z[1]},
          .a_W = {x[2], y[2], z[2]},
          .omega_B = omega,
          .alpha_B = alpha};
}

core::Pose HarmonicTrajectory::pose_at(double t_s) const {
  if (shape_.yaw_follows_path) return at(t_s).T_W_B;
  return {from_euler(shape_.yaw.value(t_s), shape_.pitch.value(t_s), shape_.roll.value(t_s)),
          {shape_.position[0].value(t_s), shape_.position[1].value(t_s), shape_.position[2].value(t_s)}};
}

HarmonicTrajectory::Shape handheld_shape(const HandheldConfig& config, core::TrialId id) {
  constexpr int kTerms = 5;
  const core::RandomStream stream(id.shared(), "trajectory/handheld");
  // One band a term, equal steps of log frequency, so that no two terms beat slowly against each other; each term has
  // the same share of the rms rate.
  const auto channel = [&](std::uint64_t index, double rate_rms) {
    SinusoidSum sum;
    const double ratio = config.highest_frequency_hz / config.lowest_frequency_hz;
    for (int k = 0; k < kTerms; ++k) {
      const auto u = stream.uniforms(index, static_cast<std::uint64_t>(k));
      const double omega = kTwoPi * config.lowest_frequency_hz * std::pow(ratio, (k + u[0]) / kTerms);
      sum.terms.push_back(
          {.amplitude = rate_rms * std::sqrt(2.0 / kTerms) / omega, .omega_rad_s = omega, .phase_rad = kTwoPi * u[1]});
    }
    return sum;
  };
  const double per_axis = 1.0 / std::sqrt(3.0);
  const double speed = config.speed_rms_m_s * per_axis;
  const double rate = config.rate_rms_rad_s * per_axis;
  return {.position = {channel(0, speed), channel(1, speed), channel(2, speed)},
          .yaw = channel(3, rate),
          .pitch = channel(4, rate),
          .roll = channel(5, rate)};
}

namespace {

// What circle and figure-eight share: a slow change of height and a gentle nod, so that no axis stays at rest.
HarmonicTrajectory::Shape loop_shape(const LoopConfig& config) {
  const double w = kTwoPi / config.period_s;
  HarmonicTrajectory::Shape shape;
  shape.position[2].terms = {{config.height_amplitude_m, 3.0 * w, 0.0}};
  shape.pitch.terms = {{0.1, 2.0 * w, 0.3}};
  shape.roll.terms = {{0.1, 3.0 * w, 1.1}};
  shape.yaw_follows_path = true;
  return shape;
}

}  // namespace

HarmonicTrajectory::Shape circle_shape(const LoopConfig& config) {
  HarmonicTrajectory::Shape shape = loop_shape(config);
  const double w = kTwoPi / config.period_s;
  shape.position[0].terms = {{config.radius_m, w, 0.5 * std::numbers::pi}};
  shape.position[1].terms = {{config.radius_m, w, 0.0}};
  return shape;
}

HarmonicTrajectory::Shape figure_eight_shape(const LoopConfig& config) {
  HarmonicTrajectory::Shape shape = loop_shape(config);
  const double w = kTwoPi / config.period_s;
  shape.position[0].terms = {{config.radius_m, w, 0.0}};
  shape.position[1].terms = {{0.5 * config.radius_m, 2.0 * w, 0.0}};
  return shape;
}

}  // namespace plumbline::sim
