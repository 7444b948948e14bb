#include "estimator/batch_start.h"

#include <algorithm>

#include <fmt/format.h>

#include "estimator/factors/imu_increment.h"
#include "estimator/line_triangulation.h"
#include "estimator/triangulation.h"

namespace plumbline::estimator {
namespace {

// When the row was exposed. Constant rate over the few milliseconds from the state: good enough to start from.
core::Pose camera_pose(const BatchInput& input, const BatchValues& values, std::size_t keyframe, double row_px) {
  const core::State& state = values.states[keyframe + 1];
  const std::size_t sample = values.samples[keyframe + 1];
  const core::TimeNs t_cam_ns = input.log.frames[input.keyframes[keyframe]].t_cam_ns;
  const double tau_s = core::to_seconds(t_cam_ns - input.log.imu[sample].t_ns) + values.calibration.td_s +
                       core::row_phase(row_px, input.log.camera.height_px) * values.calibration.readout_s;
  const Eigen::Vector3d rate = input.log.imu[sample].gyro_rad_s - state.bias.gyro_rad_s;
  const core::Pose T_W_B{state.T_W_B.q * core::exp_quaternion(rate * tau_s), state.T_W_B.p + tau_s * state.v_W};
  return T_W_B * values.calibration.T_B_C;
}

View view_of(const BatchInput& input, const BatchValues& values, std::size_t keyframe, const Eigen::Vector2d& pixel) {
  return {camera_pose(input, values, keyframe, pixel.y()), pixel};
}

// By the keyframes that are placed.
std::vector<SegmentView> views_of_line(const BatchInput& input, const BatchValues& values, const LineTrack& track) {
  std::vector<SegmentView> views;
  for (const LineTrackObservation& o : track.observations) {
    if (o.keyframe + 1 >= values.states.size()) break;
    views.push_back(
        {view_of(input, values, o.keyframe, o.ends_px[0]), view_of(input, values, o.keyframe, o.ends_px[1])});
  }
  return views;
}

}  // namespace

void BatchValues::forget_landmarks() {
  std::fill(landmarks.begin(), landmarks.end(), std::nullopt);
  std::fill(lines.begin(), lines.end(), std::nullopt);
}

std::size_t nearest_sample(const std::vector<core::ImuSample>& imu, double t_s, core::TimeNs origin_ns) {
  const auto time = [&](const core::ImuSample& s) { return core::to_seconds(s.t_ns - origin_ns); };
  const auto after =
      std::lower_bound(imu.begin(), imu.end(), t_s, [&](const core::ImuSample& s, double t) { return time(s) < t; });
  if (after == imu.begin()) return 0;
  if (after == imu.end()) return imu.size() - 1;
  const bool earlier = t_s - time(*(after - 1)) <= time(*after) - t_s;
  return static_cast<std::size_t>(after - imu.begin()) - (earlier ? 1 : 0);
}

void place_states(const BatchInput& input, std::size_t keyframes, double td_s, BatchValues& values) {
  const std::vector<core::ImuSample>& imu = input.log.imu;
  for (std::size_t k = 0; k < keyframes; ++k) {
    const core::TimeNs t_cam_ns = input.log.frames[input.keyframes[k]].t_cam_ns;
    const std::size_t sample = nearest_sample(imu, td_s, t_cam_ns);
    if (sample <= values.samples[k]) {
      throw NoStart(fmt::format(
          "keyframe {}, stamped {} ns: with td = {:.6g} s no IMU sample is left for its state after that at {} ns", k,
          t_cam_ns, td_s, imu[values.samples[k]].t_ns));
    }
    const std::size_t i = k + 1;
    if (i == values.states.size()) {
      values.states.push_back(carry(values.states[k], imu, values.samples[k], sample, input.log.gravity_m_s2));
      values.samples.push_back(sample);
    } else if (sample != values.samples[i]) {
      values.states[i] = carry(values.states[i], imu, values.samples[i], sample, input.log.gravity_m_s2);
      values.samples[i] = sample;
    }
  }
}

void triangulate_missing(const BatchInput& input, BatchValues& values) {
  const std::size_t placed = values.states.size() - 1;
  for (std::size_t t = 0; t < input.tracks.size(); ++t) {
    if (values.landmarks[t]) continue;
    std::vector<View> views;
    for (const TrackObservation& o : input.tracks[t].observations) {
      if (o.keyframe < placed) views.push_back(view_of(input, values, o.keyframe, o.pixel));
    }
    if (views.size() >= 2) values.landmarks[t] = triangulate(input.log.camera, views);
  }
  const LineStartRules rules{.sigma_px = input.noise.line_sigma_px,
                             .largest_depth_sigma = input.config.lines.largest_depth_sigma};
  for (std::size_t t = 0; t < input.line_tracks.size(); ++t) {
    if (values.lines[t] || values.culled_lines[t]) continue;
    const TriangulatedLine start =
        triangulate_line(input.log.camera, views_of_line(input, values, input.line_tracks[t]), rules);
    if (start.line) values.lines[t] = LineValue{start.origin_W, *start.line};
  }
}

std::vector<std::size_t> lines_behind(const BatchInput& input, const BatchValues& values) {
  std::vector<std::size_t> behind;
  for (std::size_t t = 0; t < input.line_tracks.size(); ++t) {
    const std::optional<LineValue>& line = values.lines[t];
    if (!line) continue;
    const PluckerLine L = OrthonormalLine(line->block.data()).plucker();
    const std::vector<SegmentView> views = views_of_line(input, values, input.line_tracks[t]);
    const bool seen = std::all_of(views.begin(), views.end(), [&](const SegmentView& view) {
      return in_front(input.log.camera, view, L, line->origin_W);
    });
    if (!seen) behind.push_back(t);
  }
  return behind;
}

}  // namespace plumbline::estimator
