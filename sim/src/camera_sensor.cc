#include "sim/camera_sensor.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace plumbline::sim {

FrameView::FrameView(const Trajectory& trajectory, const core::PinholeCamera& camera,
                     const core::RigCalibration& calibration, double t_cam_s)
    : trajectory_(trajectory), camera_(camera), calibration_(calibration), t_middle_s_(t_cam_s + calibration.td_s) {
  const Kinematics k = trajectory.at(t_middle_s_);
  const core::Pose T_W_C = k.T_W_B * calibration.T_B_C;
  T_C_W_middle_ = T_W_C.inverse();
  const Eigen::Vector3d v_W = k.v_W + k.T_W_B.q * k.omega_B.cross(calibration.T_B_C.p);
  v_C_ = T_C_W_middle_.q * v_W;
  omega_C_ = calibration.T_B_C.q.conjugate() * k.omega_B;

  double half_angle = 0.0;
  for (const double u : {-0.5, camera.width_px - 0.5}) {
    for (const double v : {-0.5, camera.height_px - 0.5}) {
      const Eigen::Vector3d corner = camera.unproject({u, v});
      half_angle = std::max(half_angle, std::acos(1.0 / corner.norm()));
    }
  }
  // Twice the motion that the middle row's speed and rate predict, so that their change is covered.
  const double half_readout_s = 0.5 * std::abs(calibration.readout_s);
  turn_rad_ = 2.0 * omega_C_.norm() * half_readout_s;
  half_angle += turn_rad_;
  reach_m_ = 2.0 * v_C_.norm() * half_readout_s;
  cos_half_angle_ = std::cos(std::min(half_angle, std::numbers::pi));
}

core::Pose FrameView::camera_pose_at(double t_imu_s) const { return trajectory_.pose_at(t_imu_s) * calibration_.T_B_C; }

bool FrameView::may_see(const Eigen::Vector3d& P_W, double nearest_m, double farthest_m) const {
  const Eigen::Vector3d P_C = T_C_W_middle_ * P_W;
  const double margin_m = reach_m_ + turn_rad_ * P_C.norm();
  if (P_C.z() < nearest_m - margin_m || P_C.z() > farthest_m + margin_m) return false;
  return P_C.z() + reach_m_ > cos_half_angle_ * (P_C.norm() - reach_m_);
}

std::optional<Exposure> FrameView::expose(const Eigen::Vector3d& P_W) const {
  const double s_per_row = calibration_.readout_s / camera_.height_px;
  const double middle_row = 0.5 * camera_.height_px;

  Eigen::Matrix<double, 2, 3> J;
  const Eigen::Vector3d P_C_middle = T_C_W_middle_ * P_W;
  const auto middle = camera_.project(P_C_middle, &J);
  if (!middle) return std::nullopt;
  // dP_C/dt = -v_C - omega_C x P_C
  const double flow_rows_s = J.row(1).dot(-v_C_ - omega_C_.cross(P_C_middle));
  const double slope = 1.0 - flow_rows_s * s_per_row;
  // The picture of a landmark that moves as fast as the shutter has no unique row.
  if (slope < 0.2) return std::nullopt;

  constexpr int kMaxIterations = 50;
  constexpr double kToleranceS = 1e-12;
  double v = middle_row + (middle->y() - middle_row) / slope;
  for (int i = 0; i < kMaxIterations; ++i) {
    const double t = t_middle_s_ + (v - middle_row) * s_per_row;
    const Eigen::Vector3d P_C = camera_pose_at(t).inverse() * P_W;
    const auto pixel = camera_.project(P_C);
    if (!pixel) return std::nullopt;
    const double defect = pixel->y() - v;
    if (std::abs(defect * s_per_row) < kToleranceS) {
      return Exposure{.pixel = *pixel, .t_imu_s = t, .depth_m = P_C.z()};
    }
    v += defect / slope;
  }
  return std::nullopt;
}

CameraRecording simulate_camera(const Trajectory& trajectory, const std::vector<Eigen::Vector3d>& landmarks,
                                const ScenarioConfig& config, double lead_s, core::TrialId id) {
  const core::RandomStream pixel_noise(id, "cam0/pixel_noise");
  const core::RandomStream loss(id, "cam0/track_loss");
  const core::RigCalibration calibration = config.calibration();
  const core::PinholeCamera& camera = config.camera.model;
  const double half_readout_s = 0.5 * std::abs(calibration.readout_s);
  const double first_s = lead_s + half_readout_s - calibration.td_s;
  const double last_s = config.duration_s - lead_s - half_readout_s - calibration.td_s;

  struct Track {
    std::int64_t id;
    int landmark;
    int frames;
  };
  CameraRecording recording;
  std::vector<Track> tracks;
  std::vector<char> tracked(landmarks.size(), 0);
  std::int64_t next_id = 0;

  const auto first_frame = static_cast<std::int64_t>(std::ceil(first_s * config.camera.rate_hz));
  const auto last_frame = static_cast<std::int64_t>(std::floor(last_s * config.camera.rate_hz));
  for (std::int64_t n = first_frame; n <= last_frame; ++n) {
    const core::TimeNs t_cam_ns = core::to_ns(static_cast<double>(n) / config.camera.rate_hz);
    const FrameView view(trajectory, camera, calibration, core::to_seconds(t_cam_ns));
    const auto frame_index = static_cast<std::uint64_t>(n - first_frame);
    core::Frame frame{.t_cam_ns = t_cam_ns, .points = {}};

    // The pixel of a landmark that is in the picture and in range, without noise.
    const auto visible = [&](int landmark) -> std::optional<Eigen::Vector2d> {
      const Eigen::Vector3d& P_W = landmarks[static_cast<std::size_t>(landmark)];
      if (!view.may_see(P_W, config.points.nearest_m, config.points.farthest_m)) return std::nullopt;
      const auto exposure = view.expose(P_W);
      if (!exposure || !camera.contains(exposure->pixel)) return std::nullopt;
      if (exposure->depth_m < config.points.nearest_m || exposure->depth_m > config.points.farthest_m) {
        return std::nullopt;
      }
      return exposure->pixel;
    };
    const auto observe = [&](const Track& track, const Eigen::Vector2d& pixel) {
      const auto landmark = static_cast<std::uint64_t>(track.landmark);
      frame.points.push_back(
          {track.id, pixel + config.camera.pixel_sigma_px * pixel_noise.normal2(frame_index, landmark)});
    };

    std::vector<Track> continued;
    const auto end_track = [&](const Track& track) { tracked[static_cast<std::size_t>(track.landmark)] = 0; };
    for (Track& track : tracks) {
      const bool lost =
          loss.uniform(frame_index, static_cast<std::uint64_t>(track.landmark)) < config.points.loss_probability;
      const bool too_long =
          config.points.longest_track_frames > 0 && track.frames >= config.points.longest_track_frames;
      const auto pixel = lost || too_long ? std::nullopt : visible(track.landmark);
      if (!pixel) {
        end_track(track);
        continue;
      }
      ++track.frames;
      observe(track, *pixel);
      continued.push_back(track);
    }
    const auto wanted = static_cast<std::size_t>(config.points.per_frame);
    for (int landmark = 0; landmark < static_cast<int>(landmarks.size()) && continued.size() < wanted; ++landmark) {
      if (tracked[static_cast<std::size_t>(landmark)] != 0) continue;
      const auto pixel = visible(landmark);
      if (!pixel) continue;
      const Track track{.id = next_id++, .landmark = landmark, .frames = 1};
      tracked[static_cast<std::size_t>(landmark)] = 1;
      recording.track_landmark.emplace(track.id, landmark);
      observe(track, *pixel);
      continued.push_back(track);
    }
    tracks = std::move(continued);
    recording.frames.push_back(std::move(frame));
  }
  return recording;
}

}  // namespace plumbline::sim
