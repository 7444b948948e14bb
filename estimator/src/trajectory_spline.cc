#include "estimator/trajectory_spline.h"

#include <algorithm>
#include <cmath>

#include "core/time.h"
#include "estimator/batch_start.h"
#include "estimator/bordered_band.h"
#include "estimator/factors/imu_increment.h"

namespace plumbline::estimator {
namespace {

struct SampleRange {
  std::size_t first;
  std::size_t last;
};

// From the prior and the first row to the last row, with room for what td and readout may still change.
SampleRange range_of(const BatchInput& input, const BatchValues& values) {
  constexpr double kMarginS = 0.01;
  const std::vector<core::ImuSample>& imu = input.log.imu;
  const double half_s = 0.5 * std::abs(values.calibration.readout_s) + kMarginS;
  const auto frame_ns = [&](std::size_t keyframe) { return input.log.frames[keyframe].t_cam_ns; };
  const double td_s = values.calibration.td_s;
  return {std::min(nearest_sample(imu, 0.0, input.log.prior.t_ns),
                   nearest_sample(imu, td_s - half_s, frame_ns(input.keyframes.front()))),
          nearest_sample(imu, td_s + half_s, frame_ns(input.keyframes.back()))};
}

double seconds_between(const BatchInput& input, std::size_t from, std::size_t to) {
  return core::to_seconds(input.log.imu[to].t_ns - input.log.imu[from].t_ns);
}

SplineKnots knots_over(double length_s, double interval_s, int order) {
  const int segments = std::max(1, static_cast<int>(std::ceil(length_s / interval_s - 1e-9)));
  return {.interval_s = length_s / segments, .order = order, .segments = segments};
}

// What is left of the six channels when each is fitted by a spline, in sums of squares over the samples' variances;
// rates by one order less than the poses', accelerations by two.
struct ChannelFit {
  std::vector<double> squares;
  int coefficients = 0;  // of a rate
};
ChannelFit fit_channels(const BatchInput& input, const SampleRange& range, double interval_s) {
  const std::vector<core::ImuSample>& imu = input.log.imu;
  const double length_s = seconds_between(input, range.first, range.last);
  const double dt_s = length_s / static_cast<double>(range.last - range.first);
  ChannelFit fit;
  for (const int derivative : {1, 2}) {
    const SplineKnots knots = knots_over(length_s, interval_s, input.config.spline.order - derivative);
    const int n = knots.controls();
    std::vector<int> reach(static_cast<std::size_t>(n));
    for (int i = 0; i < n; ++i) reach[static_cast<std::size_t>(i)] = std::min(n, i + knots.order);
    BorderedBand normal(std::move(reach), 0);
    normal.set_zero();
    Eigen::MatrixXd sums = Eigen::MatrixXd::Zero(n, 3);
    Eigen::Vector3d squares = Eigen::Vector3d::Zero();
    const double sigma = derivative == 1 ? input.noise.imu.gyro_noise_density : input.noise.imu.accel_noise_density;
    const Eigen::Vector3d offset = derivative == 1 ? imu[range.first].gyro_rad_s : imu[range.first].accel_m_s2;
    for (std::size_t s = range.first; s <= range.last; ++s) {
      const double t_s = seconds_between(input, range.first, s);
      const int segment = knots.segment(t_s);
      const core::bspline::Basis b =
          core::bspline::weights(knots.order, t_s / knots.interval_s - segment, knots.interval_s).plain[0];
      const Eigen::Vector3d y =
          std::sqrt(dt_s) / sigma * ((derivative == 1 ? imu[s].gyro_rad_s : imu[s].accel_m_s2) - offset);
      squares += y.cwiseAbs2();
      for (int i = 0; i < knots.order; ++i) {
        sums.row(segment + i) += b[i] * y.transpose();
        for (int j = 0; j <= i; ++j) *normal.at(segment + i, segment + j) += b[i] * b[j];
      }
    }
    // A coefficient that next to no sample meets.
    constexpr double kRidge = 1e-9;
    for (int i = 0; i < n; ++i) *normal.at(i, i) += kRidge;
    if (!normal.factor()) throw NoStart("no spline fits the IMU's samples");
    for (int c = 0; c < 3; ++c) {
      Eigen::VectorXd x = sums.col(c);
      normal.solve_lower(x);
      fit.squares.push_back(squares[c] - x.squaredNorm());
    }
    if (derivative == 1) fit.coefficients = n;
  }
  return fit;
}

// Of the state nearest in time, carried by the IMU; beyond the recording as it moved last.
core::Pose pose_at(const BatchInput& input, const BatchValues& values, double t_s, core::TimeNs origin_ns) {
  const std::vector<core::ImuSample>& imu = input.log.imu;
  const std::size_t sample = nearest_sample(imu, t_s, origin_ns);
  const auto after = std::lower_bound(values.samples.begin(), values.samples.end(), sample);
  auto k = static_cast<std::size_t>(after - values.samples.begin());
  if (k == values.samples.size() || (k > 0 && sample - values.samples[k - 1] < values.samples[k] - sample)) --k;
  const core::State state = carry(values.states[k], imu, values.samples[k], sample, input.log.gravity_m_s2);
  const double rest_s = t_s - core::to_seconds(imu[sample].t_ns - origin_ns);
  const Eigen::Vector3d rate = imu[sample].gyro_rad_s - state.bias.gyro_rad_s;
  return {state.T_W_B.q * core::exp_quaternion(rate * rest_s), state.T_W_B.p + rest_s * state.v_W};
}

// A bias is as good as linear over T while its walk about the line, of variance sigma_b^2 T/6 on average, is a
// hundredth of what the white noise leaves of a mean over T, sigma^2/T.
double bias_interval_s(const core::ImuNoise& noise) {
  constexpr double kShare = 0.01;
  constexpr double kLongestS = 1.0;
  const double ratio =
      std::min(noise.gyro_noise_density / noise.gyro_bias_walk, noise.accel_noise_density / noise.accel_bias_walk);
  return std::min(kLongestS, std::sqrt(6.0 * kShare) * ratio);
}

}  // namespace

SplineInstant TrajectorySpline::at(const core::MeasurementLog& log, core::TimeNs t_ns) const {
  const double t_s = seconds(log, t_ns);
  const double biases_passed = t_s / bias_interval_s;
  const int bias = std::clamp(static_cast<int>(biases_passed), 0, static_cast<int>(biases.size()) - 2);
  return {.t_s = t_s, .segment = knots.segment(t_s), .bias = bias, .bias_share = biases_passed - bias};
}

double knot_interval_by_motion(const BatchInput& input, const BatchValues& values) {
  constexpr double kWidestS = 0.4;
  constexpr double kQuantile = 4.0;  // of a normal distribution, 3 in 100,000
  const SampleRange range = range_of(input, values);
  const double sample_s =
      seconds_between(input, range.first, range.last) / static_cast<double>(range.last - range.first);
  double interval_s = kWidestS;
  ChannelFit fit = fit_channels(input, range, interval_s);
  while (0.5 * interval_s >= 3.0 * sample_s) {
    const ChannelFit finer = fit_channels(input, range, 0.5 * interval_s);
    const double dof = finer.coefficients - fit.coefficients;
    const double most = dof + kQuantile * std::sqrt(2.0 * dof);
    const bool dense = std::equal(fit.squares.begin(), fit.squares.end(), finer.squares.begin(),
                                  [&](double coarse, double fine) { return coarse - fine <= most; });
    if (dense) break;
    interval_s *= 0.5;
    fit = finer;
  }
  return interval_s;
}

TrajectorySpline start_spline(const BatchInput& input, const BatchValues& values, double interval_s) {
  const SampleRange range = range_of(input, values);
  const core::TimeNs origin_ns = input.log.imu[range.first].t_ns;
  const double length_s = seconds_between(input, range.first, range.last);
  TrajectorySpline spline{.knots = knots_over(length_s, interval_s, input.config.spline.order),
                          .first_sample = range.first,
                          .last_sample = range.last};
  const SplineKnots& knots = spline.knots;
  // Poses at the centres of the controls' bases, and what the basis, of variance k/12, would smooth away of them.
  std::vector<core::Pose> poses;
  for (int i = -1; i <= knots.controls(); ++i) {
    poses.push_back(pose_at(input, values, (i + 1 - 0.5 * knots.order) * knots.interval_s, origin_ns));
  }
  for (std::size_t i = 1; i + 1 < poses.size(); ++i) {
    const core::Pose& T = poses[i];
    const auto step = [&](const core::Pose& to) { return core::log_so3(Eigen::Quaterniond(T.q.conjugate() * to.q)); };
    const double smoothed = knots.order / 24.0;
    const Eigen::Vector3d turn = smoothed * (step(poses[i + 1]) + step(poses[i - 1]));
    spline.controls.push_back(pack(core::Pose{(T.q * core::exp_quaternion(-turn)).normalized(),
                                              T.p - smoothed * (poses[i + 1].p - 2.0 * T.p + poses[i - 1].p)}));
  }
  const int intervals = std::max(1, static_cast<int>(std::ceil(length_s / bias_interval_s(input.noise.imu))));
  spline.bias_interval_s = length_s / intervals;
  std::size_t k = 0;
  for (int i = 0; i <= intervals; ++i) {
    const std::size_t sample = nearest_sample(input.log.imu, i * spline.bias_interval_s, origin_ns);
    while (k + 1 < values.states.size() && values.samples[k] < sample) ++k;
    const core::ImuBias& bias = values.states[k].bias;
    spline.biases.emplace_back() << bias.gyro_rad_s, bias.accel_m_s2;
  }
  return spline;
}

}  // namespace plumbline::estimator
