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
  std::array<double, 4> d = {offset + slope * t_s, slope, 0.0, 0.0};
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
  double x = offset + slope * t_s;
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

HarmonicTrajectory::Shape sinusoids_shape(const SinusoidsConfig& config) {
  const auto sum = [](const WaveConfig& wave) {
    SinusoidSum s;
    s.offset = wave.offset;
    for (std::size_t i = 0; i < wave.amplitude.size(); ++i) {
      s.terms.push_back({.amplitude = wave.amplitude[i],
                         .omega_rad_s = kTwoPi * wave.frequency_hz[i],
                         .phase_rad = wave.phase_rad.empty() ? 0.0 : wave.phase_rad[i]});
    }
    return s;
  };
  return {.position = {sum(config.x), sum(config.y), sum(config.z)},
          .yaw = sum(config.yaw),
          .pitch = sum(config.pitch),
          .roll = sum(config.roll)};
}

}  // namespace plumbline::sim
