// The first states from data alone: the steps on exact input, the whole on simulated recordings, what it refuses.
#include "estimator/from_scratch.h"

#include <cmath>
#include <span>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/random.h"
#include "estimator/estimate.h"
#include "estimator/imu_path.h"
#include "estimator/ray_bundle.h"
#include "estimator/rotation_alignment.h"
#include "estimator/scale_alignment.h"
#include "estimator/structure_from_motion.h"
#include "eval/initialisation_error.h"
#include "factor_checks.h"
#include "short_recording.h"
#include "sim/simulate.h"

namespace plumbline {
namespace {

using ::testing::HasSubstr;
using testing::kEurocLike;

const core::RandomStream kRandom({12, 0}, "from_scratch_test");

sim::ScenarioConfig scenario() {
  sim::ScenarioConfig c = testing::short_scenario(100);
  c.imu.gyro_bias_rad_s = {0.01, -0.02, 0.015};
  c.imu.accel_bias_m_s2 = {0.05, -0.08, 0.03};
  return c;
}

estimator::EstimatorConfig scratch(estimator::EstimatorType type = estimator::EstimatorType::kInitialisation) {
  estimator::EstimatorConfig config = testing::believing(kEurocLike, 1.0);
  config.type = type;
  config.initialisation = estimator::Initialisation::kFromScratch;
  return config;
}

double metric(const std::vector<eval::Metric>& metrics, std::string_view name) {
  for (const eval::Metric& m : metrics) {
    if (m.name == name) return m.value;
  }
  ADD_FAILURE() << name;
  return std::nan("");
}

// The true path of the camera in units of two metres, at 30 true states 0.1 s apart, and the IMU's exact samples.
struct ExactPath {
  sim::Simulation simulation;
  core::RigCalibration rig;
  std::vector<double> stamps_s;  // camera clock, after the first picture
  std::vector<core::State> bodies;
  std::vector<core::Pose> cameras;  // T_C0_Ck
  core::TimeNs origin_ns = 0;       // of the first picture, camera clock
};

constexpr double kUnitM = 2.0;

// 2 kHz, so that the midpoint rule is off by a hundredth of what it is at 200 Hz.
ExactPath exact_path() {
  sim::ScenarioConfig c = testing::noise_free(scenario(), 2000.0);
  c.imu.gyro_bias_rad_s = {0.01, -0.02, 0.015};
  ExactPath path{.simulation = sim::simulate(c, {1, 0}), .rig = {}, .stamps_s = {}, .bodies = {}, .cameras = {}};
  path.rig = path.simulation.truth.calibration;
  constexpr std::size_t kFirst = 600;
  constexpr std::size_t kEvery = 200;
  const auto& states = path.simulation.truth.states;
  path.origin_ns = states[kFirst].t_ns - core::to_ns(path.rig.td_s);
  const core::Pose T_C0_W = (states[kFirst].state.T_W_B * path.rig.T_B_C).inverse();
  for (std::size_t k = 0; k < 30; ++k) {
    const core::StampedState& at = states[kFirst + k * kEvery];
    path.stamps_s.push_back(core::to_seconds(at.t_ns - states[kFirst].t_ns));
    path.bodies.push_back(at.state);
    path.cameras.push_back(T_C0_W * at.state.T_W_B * path.rig.T_B_C);
    path.cameras.back().p /= kUnitM;
  }
  return path;
}

// Every sign and side of the linear system: with exact input all that is left is the integrator's error.
TEST(ScaleAlignment, IsExactWithoutNoise) {
  const ExactPath exact = exact_path();
  const core::ImuBias& bias = exact.bodies.front().bias;
  const auto path = estimator::imu_path(exact.simulation.measurements.imu, exact.origin_ns, exact.stamps_s,
                                        exact.rig.td_s, {.gyro_rad_s = bias.gyro_rad_s});
  std::vector<Eigen::Vector3d> centres;
  for (const core::Pose& pose : exact.cameras) centres.push_back(pose.p);
  const auto found = estimator::align_scale(path, centres, exact.rig.T_B_C, 9.81, 0.2);
  ASSERT_TRUE(found.has_value());
  const Eigen::Quaterniond to_body = exact.bodies.front().T_W_B.q.conjugate();
  EXPECT_NEAR(found->scale, kUnitM, 1e-4);
  EXPECT_LT((found->v_B0 - to_body * exact.bodies.front().v_W).norm(), 1e-4);
  EXPECT_LT((found->gravity_B0 - to_body * Eigen::Vector3d(0.0, 0.0, -9.81)).norm(), 1e-3);
  EXPECT_LT((found->accel_bias_m_s2 - bias.accel_m_s2).norm(), 1e-3);
  EXPECT_LT(found->relative_sigma, 1e-3);
}

// At constant velocity every scale has a velocity that goes with it, and the bias takes what the accelerometer says.
TEST(ScaleAlignment, SaysWhereTheScaleIsUnknown) {
  sim::ScenarioConfig c = testing::noise_free(scenario(), 200.0);
  c.trajectory.type = sim::TrajectoryType::kConstantTwist;
  const auto s = sim::simulate(c, {1, 0});
  const core::RigCalibration& rig = s.truth.calibration;
  std::vector<double> times;
  std::vector<Eigen::Vector3d> centres;
  const core::Pose T_C0_W = (s.truth.states.front().state.T_W_B * rig.T_B_C).inverse();
  for (std::size_t k = 0; k < 600; k += 20) {
    const core::StampedState& at = s.truth.states[k];
    times.push_back(core::to_seconds(at.t_ns - s.truth.states.front().t_ns));
    // A thousandth of a unit, as pictures would leave it.
    centres.push_back((T_C0_W * at.state.T_W_B * rig.T_B_C).p + 1e-3 * kRandom.normal3(k));
  }
  const auto path = estimator::imu_path(s.measurements.imu, s.truth.states.front().t_ns, times, 0.0,
                                        {.gyro_rad_s = s.truth.states.front().state.bias.gyro_rad_s});
  const auto found = estimator::align_scale(path, centres, rig.T_B_C, 9.81, 0.2);
  EXPECT_TRUE(!found || found->relative_sigma > 0.3) << found->relative_sigma;
}

// td from 50 ms off, and of either sign: a turn that comes late is found late.
TEST(RotationAlignment, FindsBiasTdAndTheCamerasOrientation) {
  const ExactPath exact = exact_path();
  std::vector<Eigen::Quaterniond> rotations;
  for (const core::Pose& pose : exact.cameras) rotations.push_back(pose.q);
  for (const double off_s : {-0.05, 0.05}) {
    const estimator::RotationPrior prior{
        .td_s = exact.rig.td_s + off_s,
        .td_sigma_s = 0.1,
        .R_B_C = exact.rig.T_B_C.q * core::exp_quaternion(Eigen::Vector3d(0.02, -0.01, 0.015)),
        .R_B_C_sigma_rad = 0.02,
        .gyro_bias_sigma_rad_s = 0.05};
    // So small a sigma that the priors, which are not about the truth, weigh nothing.
    const auto found = estimator::align_rotations(exact.simulation.measurements.imu, exact.origin_ns, exact.stamps_s,
                                                  rotations, 1e-6, prior);
    ASSERT_TRUE(found.has_value());
    EXPECT_NEAR(found->td_s, exact.rig.td_s, 2e-5);
    EXPECT_LT((found->gyro_bias_rad_s - exact.bodies.front().bias.gyro_rad_s).norm(), 1e-4);
    EXPECT_LT(core::rotation_angle(exact.rig.T_B_C.q.conjugate() * found->R_B_C), 1e-4);
  }
}

TEST(RayFactor, JacobiansAreItsDerivatives) {
  estimator::PoseManifold manifold;
  const core::Pose T{core::exp_quaternion(Eigen::Vector3d(0.3, -0.2, 0.4)), {0.1, -0.2, 0.3}};
  const Eigen::Vector3d X = T * Eigen::Vector3d(0.4, -0.3, 4.0);
  const estimator::RayFactor factor(Eigen::Vector2d(0.11, -0.08), 2e-3);
  const std::vector<testing::Block> blocks = {testing::block(estimator::pack(T), &manifold), testing::block(X)};
  for (std::size_t k = 0; k < blocks.size(); ++k) testing::expect_jacobian(factor, blocks, k, 1e-2, 1e-8);
}

// Turned pictures have no parallax, moved ones have; wrong matches change neither.
TEST(Parallax, LeavesRotationOut) {
  const Eigen::Quaterniond turn = core::exp_quaternion(Eigen::Vector3d(0.1, -0.2, 0.3));
  estimator::PictureRays from;
  estimator::PictureRays turned;
  estimator::PictureRays moved;
  for (std::int64_t i = 0; i < 100; ++i) {
    const auto u = kRandom.uniforms(1, static_cast<std::uint64_t>(i));
    const Eigen::Vector3d X = (3.0 + 5.0 * u[2]) * Eigen::Vector3d(u[0] - 0.5, u[1] - 0.5, 1.0);
    from[i] = X.hnormalized();
    turned[i] = (turn * X).hnormalized();
    moved[i] = (turn * (X + Eigen::Vector3d(0.3, 0.0, 0.0))).hnormalized();
    if (i % 20 == 0) turned[i].x() += 0.1;
  }
  EXPECT_LT(estimator::parallax(from, turned), 1e-9);
  EXPECT_GT(estimator::parallax(from, moved), 0.005);
}

// Without noise what is left is what the linear steps leave out and the zero-mean priors of the biases ask for.
TEST(FromScratch, NoiseFreeItFindsItsState) {
  for (const double readout_s : {0.0, 0.03}) {
    sim::ScenarioConfig c = testing::noise_free(scenario(), 200.0);
    c.camera.readout_s = readout_s;
    const auto s = sim::simulate(c, {1, 0});
    const core::EstimateLog log = estimator::estimate(s.measurements, scratch());
    ASSERT_EQ(log.status, core::SolveStatus::kConverged) << log.reason;
    const auto metrics = eval::initialisation_errors(*log.initialisation, s.truth);
    EXPECT_LT(metric(metrics, "init_time_s"), 4.0);
    EXPECT_LT(std::abs(metric(metrics, "init_aligned_scale_error")), 0.1);
    EXPECT_LT(std::abs(metric(metrics, "init_scale_error")), 0.01);
    EXPECT_LT(metric(metrics, "init_gravity_deg"), 0.3);
    EXPECT_LT(metric(metrics, "init_velocity_m_s"), 0.02);
  }
}

// The estimate must not know the state that the recording's prior has.
TEST(FromScratch, NothingOfThePriorsStateIsUsed) {
  const auto s = sim::simulate(scenario(), {1, 1});
  core::MeasurementLog other = s.measurements;
  other.prior.mean.T_W_B = {core::exp_quaternion(Eigen::Vector3d(1.0, 2.0, -1.0)), {100.0, -50.0, 7.0}};
  other.prior.mean.v_W = {3.0, -2.0, 1.0};
  other.prior.mean.bias.gyro_rad_s.setConstant(std::nan(""));
  other.prior.start = other.prior.mean;
  other.prior.sigma = {};
  other.prior.t_ns += 12345678;
  for (const auto type : {estimator::EstimatorType::kInitialisation, estimator::EstimatorType::kSlidingWindow,
                          estimator::EstimatorType::kBatch}) {
    const core::EstimateLog a = estimator::estimate(s.measurements, scratch(type));
    const core::EstimateLog b = estimator::estimate(other, scratch(type));
    ASSERT_EQ(a.status, core::SolveStatus::kConverged) << a.reason;
    ASSERT_EQ(a.states.size(), b.states.size());
    for (std::size_t k = 0; k < a.states.size(); ++k) {
      EXPECT_EQ(a.states[k].t_ns, b.states[k].t_ns);
      EXPECT_EQ(a.states[k].state.T_W_B.p, b.states[k].state.T_W_B.p);
      EXPECT_EQ(a.states[k].state.T_W_B.q.coeffs(), b.states[k].state.T_W_B.q.coeffs());
    }
    EXPECT_EQ(a.calibration.td_s, b.calibration.td_s);
  }
}

// The batch in continuous time starts from the states of a window, which has none.
TEST(FromScratch, BeginsABatchInContinuousTime) {
  const auto s = sim::simulate(scenario(), {1, 1});
  estimator::EstimatorConfig config = scratch(estimator::EstimatorType::kBatch);
  config.timing = estimator::TimingModel::kSpline;
  const core::EstimateLog log = estimator::estimate(s.measurements, config);
  ASSERT_EQ(log.status, core::SolveStatus::kConverged) << log.reason;
  EXPECT_LT(std::abs(log.calibration.td_s - s.truth.calibration.td_s),
            4.5 * std::sqrt(log.covariance(core::kCovTd, core::kCovTd)));
}

// Noise and wrong matches; td from 50 ms off.
TEST(FromScratch, FindsTdWithoutKnowingIt) {
  for (const double td_s : {-0.05, 0.05}) {
    sim::ScenarioConfig c = scenario();
    c.camera.td_s = td_s;
    c.camera.gross_outlier_probability = 0.05;
    c.prior.td_mean_s = 0.0;
    c.prior.td_sigma_s = 0.1;
    const auto s = sim::simulate(c, {1, 2});
    const core::EstimateLog log = estimator::estimate(s.measurements, scratch());
    ASSERT_EQ(log.status, core::SolveStatus::kConverged) << td_s << ": " << log.reason;
    EXPECT_LT(std::abs(log.calibration.td_s - td_s), 4.5 * std::sqrt(log.covariance(core::kCovTd, core::kCovTd)));
    EXPECT_LT(std::abs(log.calibration.td_s - td_s), 3e-3);
  }
}

// Each motion that tells no scale, and what is said of it.
TEST(FromScratch, RefusesWhatTellsNoScale) {
  const auto reason_of = [](sim::TrajectoryType type) {
    sim::ScenarioConfig c = scenario();
    c.trajectory.type = type;
    const core::EstimateLog log = estimator::estimate(sim::simulate(c, {1, 3}).measurements, scratch());
    EXPECT_EQ(log.status, core::SolveStatus::kFailedInitialisation);
    return log.reason;
  };
  EXPECT_THAT(reason_of(sim::TrajectoryType::kStatic), HasSubstr("too little parallax"));
  EXPECT_THAT(reason_of(sim::TrajectoryType::kPureRotation), HasSubstr("too little parallax"));
  EXPECT_THAT(reason_of(sim::TrajectoryType::kConstantTwist), HasSubstr("too little acceleration"));
}

// A rig that has stood still for three seconds: as soon as it moves there is a start.
TEST(FromScratch, WaitsForExcitation) {
  const auto s = sim::simulate(scenario(), {1, 4});
  sim::ScenarioConfig still = scenario();
  still.trajectory.type = sim::TrajectoryType::kStatic;
  still.duration_s = 3.0;
  core::MeasurementLog log = sim::simulate(still, {1, 4}).measurements;
  const core::TimeNs step_ns = s.measurements.imu[1].t_ns - s.measurements.imu[0].t_ns;
  const core::TimeNs shift_ns = log.imu.back().t_ns + step_ns - s.measurements.imu.front().t_ns;
  for (core::ImuSample sample : s.measurements.imu) {
    sample.t_ns += shift_ns;
    log.imu.push_back(sample);
  }
  for (core::Frame frame : s.measurements.frames) {
    frame.t_cam_ns += shift_ns;
    for (core::PointObservation& o : frame.points) o.track_id += 1'000'000;
    log.frames.push_back(std::move(frame));
  }
  const core::EstimateLog estimate = estimator::estimate(log, scratch());
  ASSERT_EQ(estimate.status, core::SolveStatus::kConverged) << estimate.reason;
  const double waited_s = core::to_seconds(estimate.initialisation->at_ns - estimate.initialisation->since_ns);
  EXPECT_GT(waited_s, 3.5);
  EXPECT_LT(waited_s, 7.0);
}

}  // namespace
}  // namespace plumbline
