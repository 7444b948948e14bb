// Splines through recorded poses: what they reproduce, smooth and refuse.
#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "data_folder.h"
#include "recorded_motion.h"
#include "sim/spline_fit.h"

namespace plumbline::sim {
namespace {

std::string refusal(const std::vector<core::StampedPose>& poses, const TrajectoryConfig& config, double duration_s) {
  try {
    fit_spline(poses, config, duration_s);
  } catch (const core::RuleError& error) {
    return error.what();
  }
  return "accepted";
}

// Controls on a line at constant speed and rate give just that motion; control j has its centre at (j - 2) knots.
TEST(Spline, ReproducesConstantTwist) {
  const Eigen::Vector3d v(1.0, -2.0, 0.5);
  const Eigen::Vector3d omega(0.3, 0.5, -0.7);
  const Eigen::Quaterniond q0 = core::exp_quaternion(Eigen::Vector3d(1.0, 0.2, -0.4));
  constexpr double kKnotS = 0.5;
  std::vector<core::Pose> controls;
  for (int j = 0; j < 9; ++j) {
    const double t = kKnotS * (j - 2);
    controls.push_back({q0 * core::exp_quaternion(t * omega), t * v});
  }
  const SplineTrajectory spline(controls, kKnotS);
  EXPECT_DOUBLE_EQ(spline.end_s(), 4 * kKnotS);  // 6 controls a segment
  for (const double t : {0.0, 0.3, 0.5, 1.234, 2.0}) {
    const Kinematics k = spline.at(t);
    EXPECT_LT((k.T_W_B.p - t * v).norm(), 1e-13);
    EXPECT_LT(rotation_distance(k.T_W_B, {q0 * core::exp_quaternion(t * omega), t * v}), 1e-13);
    EXPECT_LT((k.v_W - v).norm(), 1e-12);
    EXPECT_LT((k.omega_B - omega).norm(), 1e-12);
    EXPECT_LT(k.a_W.norm(), 1e-11);  // cancels terms of 2/knot^2
    EXPECT_LT(k.alpha_B.norm(), 1e-11);
  }
}

// C^4: what the IMU sees and its slope do not jump at a knot.
TEST(Spline, AccelerationIsSmoothAcrossKnots) {
  std::vector<core::StampedPose> poses = samples();
  add_noise(poses, 0.01, 0.01);
  const SplineTrajectory spline = fit_spline(poses, {}, kDurationS).trajectory;
  constexpr double kEpsilonS = 1e-9;
  for (int knot = 1; knot < 80; ++knot) {
    const Kinematics before = spline.at(0.1 * knot - kEpsilonS);
    const Kinematics after = spline.at(0.1 * knot + kEpsilonS);
    // A jerk of 100 m/s^3 over 2e-9 s.
    EXPECT_LT((after.a_W - before.a_W).norm(), 1e-6) << knot;
    EXPECT_LT((after.alpha_B - before.alpha_B).norm(), 1e-6) << knot;
  }
}

// Quintic splines of 0.1 s knots on motion of at most 1.2 Hz, amplitude 0.04 m there: (omega h)^6/30240 of it is 2e-7
// m, a few times more at the ends of the data.
TEST(Spline, FitsSamplesOfASmoothMotion) {
  const HarmonicTrajectory truth = recorded();
  const SplineFit fit = fit_spline(samples(), {}, kDurationS);
  EXPECT_LT(fit.residuals.position_rms_m, 1e-6);
  EXPECT_LT(fit.residuals.rotation_rms_rad, 1e-6);
  EXPECT_GE(fit.trajectory.end_s(), kDurationS);
  for (int i = 0; i <= 1000; ++i) {
    const double t = kDurationS * i / 1000.0;
    const Kinematics k = fit.trajectory.at(t);
    const Kinematics expected = truth.at(t);
    EXPECT_LT((k.T_W_B.p - expected.T_W_B.p).norm(), 1e-5) << t;
    EXPECT_LT(rotation_distance(k.T_W_B, expected.T_W_B), 1e-5) << t;
    EXPECT_LT((k.omega_B - expected.omega_B).norm(), 2e-3) << t;
  }
}

TEST(Spline, StartShiftsTime) {
  const HarmonicTrajectory truth = recorded();
  for (const double start_s : {0.02, 2.0, 3.517}) {
    TrajectoryConfig config;
    config.start_s = start_s;
    const SplineTrajectory spline = fit_spline(samples(), config, kDurationS).trajectory;
    for (const double t : {0.0, 0.7, 4.0, kDurationS}) {
      EXPECT_LT((spline.pose_at(t).p - truth.pose_at(start_s + t).p).norm(), 1e-5) << start_s << ' ' << t;
      EXPECT_LT(rotation_distance(spline.pose_at(t), truth.pose_at(start_s + t)), 1e-5) << start_s << ' ' << t;
    }
  }
}

TEST(Spline, SignsOfQuaternionsDoNotMatter) {
  std::vector<core::StampedPose> poses = samples();
  const SplineTrajectory expected = fit_spline(poses, {}, kDurationS).trajectory;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    if (i % 3 == 1) poses[i].T_W_B.q.coeffs() *= -1.0;
  }
  const SplineTrajectory flipped = fit_spline(poses, {}, kDurationS).trajectory;
  for (int i = 0; i <= 100; ++i) {
    const double t = kDurationS * i / 100.0;
    EXPECT_LT(rotation_distance(flipped.pose_at(t), expected.pose_at(t)), 1e-12) << t;
    EXPECT_LT((flipped.at(t).omega_B - expected.at(t).omega_B).norm(), 1e-10) << t;
  }
}

// White noise of 10 mrad at 20 Hz: knots of 0.1 s follow half of it, which fakes angular acceleration of its amplitude
// times (pi/knot)^2. Wider ones let the residual grow towards the noise itself.
TEST(Spline, WiderKnotsSmooth) {
  std::vector<core::StampedPose> poses = samples();
  add_noise(poses, 0.01, 0.01);
  const double true_rms = motion_strength(recorded(), kDurationS).angular_acceleration_rms_rad_s2;
  double last_strength = 1e9;
  double last_residual = 0.0;
  for (const double knot_s : {0.05, 0.1, 0.2}) {
    TrajectoryConfig config;
    config.knot_interval_s = knot_s;
    const SplineFit fit = fit_spline(poses, config, kDurationS);
    const double strength = motion_strength(fit.trajectory, kDurationS).angular_acceleration_rms_rad_s2;
    EXPECT_LT(strength, 0.5 * last_strength) << knot_s;
    EXPECT_GT(fit.residuals.rotation_rms_rad, last_residual) << knot_s;
    EXPECT_GT(strength, true_rms) << knot_s;
    last_strength = strength;
    last_residual = fit.residuals.rotation_rms_rad;
  }
  // Three axes of 10 mrad, of which the fit takes 1 in 4 degrees of freedom.
  EXPECT_NEAR(last_residual, 0.01 * std::sqrt(3.0 * 0.75), 0.002);
}

TEST(Spline, RefusesGaps) {
  const auto without = [](double from_s, double to_s) {
    std::vector<core::StampedPose> poses = samples();
    std::erase_if(poses, [&](const core::StampedPose& pose) {
      const double t = core::to_seconds(pose.t_ns - kFirstStampNs);
      return t > from_s + 1e-6 && t < to_s - 1e-6;
    });
    return poses;
  };
  TrajectoryConfig config;
  config.file = "poses.tum";
  config.start_s = 2.0;
  config.largest_gap_s = 0.2;
  EXPECT_THAT(refusal(without(4.0, 4.5), config, 5.0),
              testing::AllOf(testing::StartsWith("scenario.trajectory.largest_gap_s: poses.tum: gap of 0.500 s"),
                             testing::HasSubstr("4.000 s and 4.500 s"), testing::HasSubstr("wider than 0.2 s")));
  // Over the beginning or the end of the span, with no pose of the fit on the far side.
  EXPECT_THAT(refusal(without(0.5, 3.0), config, 5.0), testing::HasSubstr("gap of 2.500 s"));
  EXPECT_THAT(refusal(without(6.0, 11.0), config, 5.0), testing::HasSubstr("gap of 5.000 s"));
  // No wider than allowed, or outside the span.
  EXPECT_EQ(refusal(without(4.0, 4.2), config, 5.0), "accepted");
  EXPECT_EQ(refusal(without(0.2, 0.8), config, 5.0), "accepted");
  EXPECT_EQ(refusal(without(9.0, 10.0), config, 5.0), "accepted");
}

// The same path, travelled twice as fast: speed and rate double, accelerations are four times as large.
TEST(Spline, SpeedUpCompressesTime) {
  TrajectoryConfig config;
  config.start_s = 1.0;
  const SplineTrajectory usual = fit_spline(samples(), config, 8.0).trajectory;
  config.speed_up = 2.0;
  const SplineTrajectory fast = fit_spline(samples(), config, 4.0).trajectory;
  for (const double t : {0.0, 0.31, 2.0, 4.0}) {
    const Kinematics a = usual.at(2.0 * t);
    const Kinematics b = fast.at(t);
    EXPECT_LT((b.T_W_B.p - a.T_W_B.p).norm(), 1e-12) << t;
    EXPECT_LT(rotation_distance(b.T_W_B, a.T_W_B), 1e-12) << t;
    EXPECT_LT((b.v_W - 2.0 * a.v_W).norm(), 1e-11) << t;
    EXPECT_LT((b.a_W - 4.0 * a.a_W).norm(), 1e-10) << t;
    EXPECT_LT((b.omega_B - 2.0 * a.omega_B).norm(), 1e-11) << t;
    EXPECT_LT((b.alpha_B - 4.0 * a.alpha_B).norm(), 1e-10) << t;
  }
  EXPECT_THAT(refusal(samples(), config, 6.0), testing::HasSubstr("= 13 s"));
}

TEST(Spline, LongestSegmentStepsAroundGaps) {
  const HarmonicTrajectory truth = recorded();
  std::vector<core::StampedPose> poses = samples(12.0);
  std::erase_if(poses, [](const core::StampedPose& pose) {
    const double t = core::to_seconds(pose.t_ns - kFirstStampNs);
    return (t > 2.01 && t < 2.99) || (t > 10.01 && t < 10.99);
  });
  TrajectoryConfig config;
  config.file = "poses.tum";
  EXPECT_THAT(refusal(poses, config, 6.0), testing::HasSubstr("on_gap: longest_segment"));
  config.on_gap = OnGap::kLongestSegment;
  config.start_s = 0.5;
  const SplineFit fit = fit_spline(poses, config, 6.0);
  EXPECT_NEAR(fit.span.from_s, 3.0, 1e-9);
  EXPECT_NEAR(fit.span.to_s, 10.0, 1e-9);
  for (const double t : {0.0, 2.0, 6.0}) {
    EXPECT_LT((fit.trajectory.pose_at(t).p - truth.pose_at(3.5 + t).p).norm(), 1e-5) << t;
  }
  EXPECT_THAT(refusal(poses, config, 6.6), testing::HasSubstr("longest piece without a gap spans only 7.000 s"));
}

// Motion capture at 120 Hz that lost the rig now and then.
TEST(Spline, RecordedRoomHasGaps) {
  TrajectoryConfig config;
  config.type = TrajectoryType::kSpline;
  config.file = data_folder() / "trajectories/tum_room1.txt";
  if (!std::filesystem::exists(config.file)) GTEST_SKIP() << config.file << " is absent (PLUMBLINE_DATA)";
  EXPECT_THROW(make_trajectory(config, 135.0, kId), core::RuleError);
  config.on_gap = OnGap::kLongestSegment;
  const auto report = spline_report(config, 10.0);
  ASSERT_TRUE(report.has_value());
  EXPECT_EQ(report->format, core::PoseFormat::kTum);
  EXPECT_LT(report->to_s - report->from_s, 141.0);
  EXPECT_GT(report->to_s - report->from_s, 10.0);
  EXPECT_LT(report->residuals.position_rms_m, 2e-3);  // as large as the motion between knots of 0.1 s leaves
}

TEST(Spline, RefusesFilesThatAreTooShort) {
  TrajectoryConfig config;
  config.file = "poses.tum";
  EXPECT_EQ(refusal(samples(8.0), config, 8.0), "accepted");
  EXPECT_THAT(refusal(samples(7.95), config, 8.0), testing::HasSubstr("spans only 7.950 s"));
  TrajectoryConfig late = config;
  late.start_s = 0.5;
  EXPECT_THAT(refusal(samples(8.0), late, 8.0), testing::HasSubstr("= 8.5 s"));
  late.start_s = 100.0;
  EXPECT_THAT(refusal(samples(8.0), late, 1.0), testing::HasSubstr("start_s"));
  EXPECT_THAT(refusal({samples(8.0).front()}, config, 1.0), testing::HasSubstr("spans only 0.000 s"));
}

TEST(Spline, FilesGoThroughMakeTrajectory) {
  TrajectoryConfig config = config_of(TrajectoryType::kSpline);
  const FitResiduals residuals = spline_report(config, kDurationS).value_or(SplineReport{}).residuals;
  EXPECT_GT(residuals.rotation_rms_rad, 0.005);
  EXPECT_LT(residuals.rotation_rms_rad, 0.02);
  EXPECT_FALSE(spline_report(config_of(TrajectoryType::kHandheld), kDurationS).has_value());
  config.file += ".missing";
  EXPECT_THROW(make_trajectory(config, kDurationS, kId), core::DataError);
}

}  // namespace
}  // namespace plumbline::sim
