// A motion, and poses as if recorded of it: what the tests of trajectories and splines share.
#pragma once

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "core/lie.h"
#include "core/pose_file.h"
#include "core/random.h"
#include "sim/handheld_motion.h"
#include "sim/harmonic_trajectory.h"
#include "sim/trajectory.h"

namespace plumbline::sim {

inline constexpr core::TrialId kId{.seed = 1, .trial = 0};
inline constexpr double kDurationS = 8.0;

// The motion of configs/scenarios/handheld_rs.yaml.
inline HandheldConfig handheld_rs() { return {.speed_rms_m_s = 0.7, .rate_rms_rad_s = 0.75}; }

inline HarmonicTrajectory recorded() { return HarmonicTrajectory(handheld_shape(handheld_rs(), kId)); }

inline constexpr core::TimeNs kFirstStampNs =
    1'403'636'580'000'000'000;  // the time of a file counts from its first pose

// Samples of the recorded motion at 20 Hz, [0, length_s].
inline std::vector<core::StampedPose> samples(double length_s = 12.0) {
  const HarmonicTrajectory trajectory = recorded();
  std::vector<core::StampedPose> poses;
  for (int i = 0; 0.05 * i <= length_s + 1e-9; ++i) {
    poses.push_back({kFirstStampNs + i * core::TimeNs{50'000'000}, trajectory.pose_at(0.05 * i)});
  }
  return poses;
}

inline void add_noise(std::vector<core::StampedPose>& poses, double position_sigma_m, double rotation_sigma_rad) {
  const core::RandomStream stream(kId, "test/pose_noise");
  for (std::size_t i = 0; i < poses.size(); ++i) {
    poses[i].T_W_B.p += position_sigma_m * stream.normal3(i, 0);
    poses[i].T_W_B.q = poses[i].T_W_B.q * core::exp_quaternion(rotation_sigma_rad * stream.normal3(i, 1));
  }
}

inline TrajectoryConfig config_of(TrajectoryType type) {
  TrajectoryConfig config;
  config.type = type;
  config.handheld = handheld_rs();
  config.sinusoids.x.amplitude = {0.8, 0.1};
  config.sinusoids.x.frequency_hz = {0.2, 1.1};
  config.sinusoids.z.offset = 1.5;
  config.sinusoids.pitch.amplitude = {0.3};
  config.sinusoids.pitch.frequency_hz = {0.5};
  config.sinusoids.pitch.phase_rad = {1.0};
  if (type == TrajectoryType::kSpline) {
    std::string test = testing::UnitTest::GetInstance()->current_test_info()->name();
    std::ranges::replace(test, '/', '_');
    config.file = std::filesystem::path(testing::TempDir()) / ("plumbline_trajectory_" + test + ".tum");
    std::vector<core::StampedPose> poses = samples();
    add_noise(poses, 0.01, 0.01);
    core::write_tum(config.file, poses);
  }
  return config;
}

inline double rotation_distance(const core::Pose& a, const core::Pose& b) {
  return core::rotation_angle(a.q.conjugate() * b.q);
}

}  // namespace plumbline::sim
