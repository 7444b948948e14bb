#include "estimator/imu_path.h"

#include <algorithm>

namespace plumbline::estimator {
namespace {

core::ImuSample sample_at(std::span<const core::ImuSample> imu, core::TimeNs origin_ns, double t_s) {
  const auto time = [&](const core::ImuSample& s) { return core::to_seconds(s.t_ns - origin_ns); };
  const auto after =
      std::lower_bound(imu.begin(), imu.end(), t_s, [&](const core::ImuSample& s, double t) { return time(s) < t; });
  if (after == imu.begin()) return imu.front();
  if (after == imu.end()) return imu.back();
  const core::ImuSample& a = *(after - 1);
  const double share = (t_s - time(a)) / (time(*after) - time(a));
  return {.t_ns = a.t_ns,
          .gyro_rad_s = a.gyro_rad_s + share * (after->gyro_rad_s - a.gyro_rad_s),
          .accel_m_s2 = a.accel_m_s2 + share * (after->accel_m_s2 - a.accel_m_s2)};
}

}  // namespace

ImuPath imu_path(std::span<const core::ImuSample> imu, core::TimeNs origin_ns, std::span<const double> stamps_s,
                 double td_s, const core::ImuBias& bias) {
  ImuPath path;
  const auto time = [&](const core::ImuSample& s) { return core::to_seconds(s.t_ns - origin_ns); };
  const double first_s = stamps_s.front() + td_s;
  auto next = std::upper_bound(imu.begin(), imu.end(), first_s,
                               [&](double t, const core::ImuSample& s) { return t < time(s); });
  double now_s = first_s;
  core::ImuSample now = sample_at(imu, origin_ns, now_s);
  ImuIncrement x;
  const auto go_to = [&](const core::ImuSample& to, double t_s) {
    advance(now, to, bias, t_s - now_s, x);
    now = to;
    now_s = t_s;
  };
  for (const double stamp_s : stamps_s) {
    const double t_s = stamp_s + td_s;
    for (; next != imu.end() && time(*next) < t_s; ++next) go_to(*next, time(*next));
    if (t_s > now_s) go_to(sample_at(imu, origin_ns, t_s), t_s);
    path.t_s.push_back(t_s - first_s);
    path.motion.push_back(x);
    path.rate_B.push_back(now.gyro_rad_s - bias.gyro_rad_s);
  }
  return path;
}

}  // namespace plumbline::estimator
