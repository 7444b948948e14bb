// The Cramer-Rao bound against brute force: the covariance that the batch estimator's own factors give at the truth,
// and Monte-Carlo draws of the linear model.
#include "eval/cramer_rao.h"

#include <array>
#include <cmath>
#include <map>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include "bound_problem.h"
#include "core/random.h"
#include "estimator/batch_problem.h"
#include "estimator/estimate.h"
#include "estimator/factors/imu_factor.h"
#include "estimator/factors/world_point.h"
#include "eval/metric_bound.h"
#include "eval/trajectory_error.h"
#include "sim/simulate.h"

namespace plumbline::eval {
namespace {

using plumbline::testing::every_second_frame;
using plumbline::testing::nearest_sample;
using plumbline::testing::true_states;

sim::ScenarioConfig small_scenario() { return plumbline::testing::bound_scenario(12); }

// The truth as values of the batch problem. A landmark is taken in its anchor so that the model, not the trajectory,
// maps it to the true point: both sides then linearise at the same place to the last digit.
estimator::BatchValues true_values(const estimator::BatchInput& input, const sim::GroundTruth& truth) {
  const core::MeasurementLog& log = input.log;
  estimator::BatchValues values = true_states(input, truth);
  const estimator::CameraModel model{log.camera, log.pixel_sigma_px, log.gravity_m_s2};
  for (const estimator::Track& track : input.tracks) {
    const std::size_t k = track.observations.front().keyframe;
    const core::State& state = values.states[k + 1];
    const std::size_t sample = values.samples[k + 1];
    const auto motion = std::make_shared<estimator::LocalMotion>(log.imu, sample, 0.1, state.bias);
    const double offset_s = core::to_seconds(log.frames[input.keyframes[k]].t_cam_ns - log.imu[sample].t_ns);
    const Eigen::Vector3d P_W = truth.landmarks_W[static_cast<std::size_t>(truth.track_landmark.at(track.id))];
    const auto view = estimator::observe_world_point(model, {motion, offset_s}, state, truth.calibration, P_W,
                                                     track.observations.front().pixel.y());
    estimator::TimedBody body;
    EXPECT_TRUE(view && estimator::BodyPath(*motion, state, log.gravity_m_s2).at(view->tau_s, body));
    const core::Pose T_W_C = core::Pose{Eigen::Quaterniond(body.R), body.p} * truth.calibration.T_B_C;
    const Eigen::Vector3d P_C = T_W_C.inverse() * P_W;
    values.landmarks.emplace_back(Eigen::Vector3d(P_C.x() / P_C.z(), P_C.y() / P_C.z(), 1.0 / P_C.z()));
  }
  return values;
}

class Bound : public ::testing::Test {
 protected:
  core::PosteriorCovariance brute_force(const estimator::EstimatorConfig& config) const {
    estimator::BatchInput input{
        .log = log(),
        .config = config,
        .noise = estimator::believed_noise(config, log().imu_noise, log().pixel_sigma_px, log().line_sigma_px),
        .keyframes = every_second_frame(log()),
        .tracks = {}};
    input.tracks = estimator::collect_tracks(log().frames, input.keyframes, log().camera);
    return *estimator::BatchProblem(input, true_values(input, simulation_.truth)).covariance();
  }
  CramerRaoBound bound(BoundOptions options) const {
    options.frames = every_second_frame(log());
    return cramer_rao_bound(log(), simulation_.truth, options);
  }
  const core::MeasurementLog& log() const { return simulation_.measurements; }

  sim::Simulation simulation_ = [] {
    sim::Simulation s = sim::simulate(small_scenario(), {3, 0});
    s.measurements.imu = noise_free_imu(s.measurements, s.truth);  // what the bound linearises at
    return s;
  }();
};

// Each entry against the geometric mean of its diagonal ones.
void expect_same(const core::PosteriorCovariance& a, const core::PosteriorCovariance& b, double tolerance) {
  for (int r = 0; r < core::kCovDim; ++r) {
    for (int c = 0; c < core::kCovDim; ++c) {
      EXPECT_LE(std::abs(a(r, c) - b(r, c)), tolerance * std::sqrt(b(r, r) * b(c, c))) << r << " " << c;
    }
  }
}

// Every Jacobian of the measurements in one matrix, whose information is inverted in extended precision.
core::PosteriorCovariance dense_bound(const core::MeasurementLog& log, const sim::GroundTruth& truth,
                                      const std::vector<std::size_t>& frames, const std::vector<std::size_t>& samples) {
  constexpr int kDof = core::kStateDof;
  constexpr int kCalibration = core::kCovLastState;
  std::map<std::int64_t, int> seen;  // observations of each track
  for (const std::size_t frame : frames) {
    for (const core::PointObservation& o : log.frames[frame].points) ++seen[o.track_id];
  }
  std::map<std::int64_t, int> column;
  int columns = kCalibration + kDof * static_cast<int>(samples.size());
  for (const auto& [track, count] : seen) {
    if (count >= 2) column[track] = std::exchange(columns, columns + 3);
  }
  using Matrix = Eigen::Matrix<long double, Eigen::Dynamic, Eigen::Dynamic>;
  Matrix information = Matrix::Zero(columns, columns);
  const auto add = [&](const Eigen::MatrixXd& J, const std::vector<std::pair<int, int>>& blocks) {
    Matrix wide = Matrix::Zero(J.rows(), columns);
    Eigen::Index at = 0;
    for (const auto& [first, width] : blocks) {
      wide.middleCols(first, width) = J.middleCols(at, width).cast<long double>();
      at += width;
    }
    information += wide.transpose() * wide;
  };
  const auto column_of_state = [](std::size_t k) { return kCalibration + kDof * static_cast<int>(k); };
  const core::CalibrationSigmas& s = log.prior.calibration_sigma;
  Eigen::Matrix<double, kCalibration, 1> sigmas;
  sigmas << Eigen::Vector3d::Constant(s.extrinsic_position_m), Eigen::Vector3d::Constant(s.extrinsic_rotation_rad),
      s.td_s, s.readout_s;
  add(sigmas.cwiseInverse().asDiagonal(), {{0, kCalibration}});
  add(log.prior.sigma.per_axis().cwiseInverse().asDiagonal(), {{column_of_state(0), kDof}});

  const auto state = [&](std::size_t k) { return sim::state_at(truth, log.imu[samples[k]].t_ns); };
  const estimator::CameraModel model{log.camera, log.pixel_sigma_px, log.gravity_m_s2};
  for (std::size_t k = 0; k < frames.size(); ++k) {
    const std::span<const core::ImuSample> imu(&log.imu[samples[k]], samples[k + 1] - samples[k] + 1);
    const estimator::ImuFactor factor(estimator::preintegrate(imu, state(k).bias, log.imu_noise), log.gravity_m_s2);
    const std::array<estimator::StateBlock, 2> x = {estimator::pack(state(k)), estimator::pack(state(k + 1))};
    using Ambient = Eigen::Matrix<double, kDof, estimator::kStateSize, Eigen::RowMajor>;
    std::array<Ambient, 2> ambient;
    core::StateTangent residual;
    const std::array<const double*, 2> parameters = {x[0].data(), x[1].data()};
    std::array<double*, 2> jacobians = {ambient[0].data(), ambient[1].data()};
    factor.Evaluate(parameters.data(), residual.data(), jacobians.data());
    Eigen::MatrixXd J(kDof, 2 * kDof);
    for (int b = 0; b < 2; ++b) {
      Eigen::Matrix<double, estimator::kStateSize, kDof, Eigen::RowMajor> plus;
      estimator::StateManifold().PlusJacobian(parameters[static_cast<std::size_t>(b)], plus.data());
      J.middleCols<kDof>(kDof * b) = ambient[static_cast<std::size_t>(b)] * plus;
    }
    add(J, {{column_of_state(k), kDof}, {column_of_state(k + 1), kDof}});

    const core::Frame& frame = log.frames[frames[k]];
    const std::size_t sample = samples[k + 1];
    const auto motion = std::make_shared<estimator::LocalMotion>(log.imu, sample, 0.1, state(k + 1).bias);
    for (const core::PointObservation& o : frame.points) {
      if (!column.contains(o.track_id)) continue;
      const Eigen::Vector3d& P_W = truth.landmarks_W[static_cast<std::size_t>(truth.track_landmark.at(o.track_id))];
      estimator::WorldPointJacobians at;
      estimator::observe_world_point(model, {motion, core::to_seconds(frame.t_cam_ns - log.imu[sample].t_ns)},
                                     state(k + 1), truth.calibration, P_W, o.pixel.y(), &at);
      Eigen::MatrixXd point(2, kCalibration + kDof + 3);
      point << at.extrinsics, at.td, at.readout, at.state, at.point;
      add(point, {{0, kCalibration}, {column_of_state(k + 1), kDof}, {column.at(o.track_id), 3}});
    }
  }
  const Matrix Sigma = information.ldlt().solve(Matrix::Identity(columns, columns));
  core::PosteriorCovariance P = core::PosteriorCovariance::Zero();
  const int last = column_of_state(samples.size() - 1);
  P.topLeftCorner<core::kCovIntrinsics, core::kCovIntrinsics>()
      << Sigma.topLeftCorner(kCalibration, kCalibration).cast<double>(),
      Sigma.block(0, last, kCalibration, kDof).cast<double>(), Sigma.block(last, 0, kDof, kCalibration).cast<double>(),
      Sigma.block(last, last, kDof, kDof).cast<double>();
  return P;
}

// Less than a second: normal equations lose digits with the length of the recording.
TEST(CramerRaoBound, EqualsTheInverseOfTheDenseInformation) {
  sim::ScenarioConfig c = small_scenario();
  c.duration_s = 0.7;
  auto [log, truth] = sim::simulate(c, {3, 0});
  log.imu = noise_free_imu(log, truth);
  const std::vector<std::size_t> frames = every_second_frame(log);
  std::vector<std::size_t> samples = {0};
  for (const std::size_t k : frames) {
    samples.push_back(nearest_sample(log, log.frames[k].t_cam_ns + core::to_ns(truth.calibration.td_s)));
  }
  expect_same(cramer_rao_bound(log, truth, {.frames = frames}).covariance, dense_bound(log, truth, frames, samples),
              1e-9);
}

// Central differences are off by the third derivatives: dt^2/6 of them.
TEST(CramerRaoBound, NoiseFreeSamplesAreThoseOfTheSimulator) {
  sim::ScenarioConfig c = small_scenario();
  const auto [noisy, truth] = sim::simulate(c, {3, 0});
  const std::vector<core::ImuSample> samples = noise_free_imu(noisy, truth);
  c.imu.noise = {};
  const auto [exact, same_truth] = sim::simulate(c, {3, 0});
  ASSERT_EQ(samples.size(), exact.imu.size());
  for (std::size_t i = 1; i + 1 < samples.size(); ++i) {
    const core::ImuBias& walked = truth.states[i].state.bias;
    const core::ImuBias& constant = same_truth.states[i].state.bias;
    const Eigen::Vector3d rate = exact.imu[i].gyro_rad_s - constant.gyro_rad_s + walked.gyro_rad_s;
    const Eigen::Vector3d accel = exact.imu[i].accel_m_s2 - constant.accel_m_s2 + walked.accel_m_s2;
    EXPECT_LT((samples[i].gyro_rad_s - rate).norm(), 1e-3) << i;
    EXPECT_LT((samples[i].accel_m_s2 - accel).norm(), 2e-2) << i;
  }
}

// A rig at rest says nothing of td, readout and extrinsics, and neither does its noise.
TEST(CramerRaoBound, RestLeavesThePriors) {
  sim::ScenarioConfig c = small_scenario();
  c.duration_s = 4.0;
  c.trajectory.type = sim::TrajectoryType::kStatic;
  const auto [log, truth] = sim::simulate(c, {3, 0});
  const core::PosteriorCovariance P = cramer_rao_bound(log, truth, {.frames = every_second_frame(log)}).covariance;
  const core::CalibrationSigmas& prior = log.prior.calibration_sigma;
  EXPECT_NEAR(std::sqrt(P(core::kCovTd, core::kCovTd)), prior.td_s, 1e-3 * prior.td_s);
  EXPECT_NEAR(std::sqrt(P(core::kCovReadout, core::kCovReadout)), prior.readout_s, 1e-3 * prior.readout_s);
  EXPECT_NEAR(std::sqrt(P(0, 0)), prior.extrinsic_position_m, 1e-3 * prior.extrinsic_position_m);
}

// Anchored landmarks of weak parallax and the estimator's normal equations leave fewer digits.
TEST_F(Bound, IsWhatTheEstimatorsOwnFactorsGiveAtTheTruth) { expect_same(bound({}).covariance, brute_force({}), 1e-8); }

TEST_F(Bound, HoldsWhatIsNotFree) {
  estimator::EstimatorConfig config;
  config.estimate = {.td = true, .readout = false, .extrinsics = false};
  const CramerRaoBound fixed = bound({.frames = {}, .td = true, .readout = false, .extrinsics = false});
  expect_same(fixed.covariance, brute_force(config), 1e-8);
  EXPECT_EQ(fixed.covariance(core::kCovReadout, core::kCovReadout), 0.0);
  // What is known need not be estimated.
  EXPECT_LT(fixed.covariance(core::kCovTd, core::kCovTd), bound({}).covariance(core::kCovTd, core::kCovTd));
}

TEST_F(Bound, CausalBoundFallsToTheFullOne) {
  const CramerRaoBound b = bound({.frames = {}, .causal = true});
  ASSERT_EQ(b.causal.size(), every_second_frame(log()).size());
  for (std::size_t k = 1; k < b.causal.size(); ++k) {
    EXPECT_LE(b.causal[k].covariance(core::kCovTd, core::kCovTd),
              b.causal[k - 1].covariance(core::kCovTd, core::kCovTd) * (1.0 + 1e-6));
  }
  // InformationChain::kWeak leaks in.
  expect_same(b.causal.back().covariance, b.covariance, 1e-5);
  // Before there is parallax td is known as well as its prior says.
  EXPECT_NEAR(std::sqrt(b.causal.front().covariance(core::kCovTd, core::kCovTd)), log().prior.calibration_sigma.td_s,
              1e-2 * log().prior.calibration_sigma.td_s);

  const std::vector<BoundPoint> series = bound_series(b, b.t_ns.front());
  ASSERT_EQ(series.size(), b.causal.size());
  EXPECT_DOUBLE_EQ(series.back().t_s, core::to_seconds(b.t_ns.back() - b.t_ns.front()));
  EXPECT_NEAR(series.back().td_s, *metric_bound(b, "td_error_s"), 1e-5 * series.back().td_s);
  EXPECT_NEAR(series.back().position_m, *metric_bound(b, "final_position"), 1e-5 * series.back().position_m);
  EXPECT_NEAR(core::kDegreesPerRadian * series.back().orientation_rad, *metric_bound(b, "final_orientation_deg"), 1e-5);
}

TEST_F(Bound, TheCamerasDerivativesAreThoseOfDifferences) {
  const core::MeasurementLog& l = log();
  const core::StampedState& at = simulation_.truth.states[nearest_sample(l, l.frames[20].t_cam_ns)];
  const std::size_t sample = nearest_sample(l, at.t_ns);
  const auto motion = std::make_shared<estimator::LocalMotion>(l.imu, sample, 0.1, at.state.bias);
  const estimator::FrameTiming timing{motion, core::to_seconds(l.frames[20].t_cam_ns - at.t_ns)};
  const core::PointObservation& o = l.frames[20].points.front();
  const Eigen::Vector3d& P_W =
      simulation_.truth.landmarks_W[static_cast<std::size_t>(simulation_.truth.track_landmark.at(o.track_id))];
  const auto observe = [&](const core::Intrinsics& d, estimator::WorldPointJacobians* J) {
    const estimator::CameraModel model{l.camera.with(l.camera.intrinsics() + d), 0.5, l.gravity_m_s2};
    return observe_world_point(model, timing, at.state, simulation_.truth.calibration, P_W, o.pixel.y(), J)->pixel;
  };
  estimator::WorldPointJacobians J;
  observe(core::Intrinsics::Zero(), &J);
  for (int i = 0; i < 4; ++i) {
    const core::Intrinsics d = 0.1 * core::Intrinsics::Unit(i);
    const Eigen::Vector2d numeric = (observe(d, nullptr) - observe(-d, nullptr)) / (2.0 * 0.1 * 0.5);
    // Of a row found to 1e-7 px. The share of the time is some percent.
    EXPECT_LT((J.intrinsics.col(i) - numeric).norm(), 1e-5) << i;
  }
}

// The window's own information, at a minimum that lies next to the truth, since nothing is noisy.
TEST(CramerRaoBound, OfAnUnknownCameraIsWhatTheWindowStates) {
  sim::ScenarioConfig c = small_scenario();
  c.prior.focal_sigma_px = 5.0;
  c.prior.principal_point_sigma_px = 4.0;
  auto [log, truth] = sim::simulate(c, {3, 0});
  c.camera.pixel_sigma_px = 0.0;
  log.frames = sim::simulate(c, {3, 0}).measurements.frames;
  log.imu = noise_free_imu(log, truth);
  estimator::EstimatorConfig config;
  config.type = estimator::EstimatorType::kSlidingWindow;
  config.estimate.intrinsics = true;
  config.window.keyframes = 1000;
  config.window.keyframe_parallax_px = 0.0;
  config.window.largest_depth_sigma = 1e6;  // the bound has no belief of depths
  const core::EstimateLog estimate = estimator::estimate(log, config);
  ASSERT_EQ(estimate.status, core::SolveStatus::kConverged) << estimate.reason;
  BoundOptions options{.frames = estimator::select_keyframes(log.frames, config.keyframe_rate_hz), .intrinsics = true};
  const core::PosteriorCovariance bound = cramer_rao_bound(log, truth, options).covariance;
  expect_same(estimate.covariance, bound, 0.02);
  options.intrinsics = false;
  const core::PosteriorCovariance known = cramer_rao_bound(log, truth, options).covariance;
  EXPECT_TRUE((known.bottomRightCorner<4, 4>().isZero(0.0)));
  EXPECT_LT(known(core::kCovTd, core::kCovTd), bound(core::kCovTd, core::kCovTd));
  // Something is learned of each.
  const core::CalibrationSigmas& prior = log.prior.calibration_sigma;
  EXPECT_LT(bound(core::kCovIntrinsics, core::kCovIntrinsics), 0.5 * prior.focal_px * prior.focal_px);
}

// Samples that dropped out are in the truth and not in the log. The density of the noise stays, so that their loss
// costs next to nothing.
TEST_F(Bound, LostSamplesMoveItLittle) {
  sim::ScenarioConfig c = small_scenario();
  const auto bound_of = [&] {
    const sim::Simulation s = sim::simulate(c, {3, 0});
    return cramer_rao_bound(s.measurements, s.truth, {.frames = every_second_frame(s.measurements)});
  };
  const CramerRaoBound all = bound_of();
  c.imu.dropout_probability = 0.3;
  const CramerRaoBound some = bound_of();
  const double td = all.covariance(core::kCovTd, core::kCovTd);
  EXPECT_NEAR(some.covariance(core::kCovTd, core::kCovTd), td, 0.05 * td);
  EXPECT_NEAR(some.ate.position_m, all.ate.position_m, 0.05 * all.ate.position_m);
  EXPECT_NEAR(some.ate.rotation_rad, all.ate.rotation_rad, 0.05 * all.ate.rotation_rad);
}

TEST_F(Bound, LastPoseIsThatOfTheLastState) {
  const CramerRaoBound b = bound({});
  const PoseCovariance last = b.covariance.block<6, 6>(core::kCovLastState, core::kCovLastState);
  EXPECT_LT((b.poses.back() - last).norm(), 1e-9 * last.norm());
  // The first state's prior fixes the gauge and is all that is known of the place.
  EXPECT_NEAR(std::sqrt(b.poses.front()(0, 0)), log().prior.sigma.position_m, 0.05 * log().prior.sigma.position_m);
}

// A chain of poses with random measurements, drawn from its dense covariance and aligned by the real thing.
TEST(AlignedBound, EqualsMonteCarloOfTheLinearModel) {
  constexpr int kPoses = 12;
  constexpr int kDraws = 4000;
  const core::RandomStream random({31, 0}, "aligned_bound_test");
  InformationChain chain;
  std::vector<core::Pose> truth;
  std::vector<ScaledPose> rows;
  std::vector<int> variables;
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(6 * kPoses, 6 * kPoses);
  const auto observe = [&](const std::vector<int>& which, const Eigen::MatrixXd& J) {
    std::vector<int> chosen;
    Eigen::MatrixXd wide = Eigen::MatrixXd::Zero(J.rows(), 6 * kPoses);
    for (std::size_t i = 0; i < which.size(); ++i) {
      chosen.push_back(variables[static_cast<std::size_t>(which[i])]);
      wide.middleCols<6>(6 * which[i]) = J.middleCols<6>(6 * static_cast<Eigen::Index>(i));
    }
    chain.observe(chosen, J);
    information += wide.transpose() * wide;
  };
  for (int k = 0; k < kPoses; ++k) {
    const auto index = static_cast<std::uint64_t>(k);
    truth.push_back({core::exp_quaternion(random.normal3(index, 0)), 3.0 * random.normal3(index, 1)});
    variables.push_back(chain.add(6));
    rows.push_back({chain.offset(variables.back()), chain.offset(variables.back()) + 3, 1e-4, 1e-4});
    Eigen::MatrixXd J(6, k == 0 ? 6 : 12);
    for (int r = 0; r < 6; ++r) {
      const auto row = 12 * static_cast<std::uint64_t>(r);
      for (int c = 0; c < J.cols(); ++c) J(r, c) = random.normal(100 + index, row + static_cast<std::uint64_t>(c));
    }
    J.rightCols<6>() += 3.0 * Eigen::MatrixXd::Identity(6, 6);
    observe(k == 0 ? std::vector<int>{0} : std::vector<int>{k - 1, k}, J);
  }
  chain.finish();
  const Eigen::MatrixXd Sigma = 1e-8 * information.inverse();
  const Eigen::MatrixXd L = Sigma.llt().matrixL();
  std::vector<PoseCovariance> covariances;
  for (int k = 0; k < kPoses; ++k) covariances.emplace_back(Sigma.block<6, 6>(6 * k, 6 * k));

  for (const Alignment alignment : {Alignment::kNone, Alignment::kPosyaw, Alignment::kSe3, Alignment::kSim3}) {
    const AlignedBound b = aligned_bound(chain, truth, rows, covariances, alignment);
    std::vector<double> squares_p;
    std::vector<double> squares_theta;
    for (int draw = 0; draw < kDraws; ++draw) {
      Eigen::VectorXd n(6 * kPoses);
      for (int i = 0; i < n.size(); ++i) {
        n[i] = random.normal(1000 + static_cast<std::uint64_t>(draw), static_cast<std::uint64_t>(i));
      }
      const Eigen::VectorXd e = L * n;
      std::vector<PosePair> pairs;
      for (int k = 0; k < kPoses; ++k) {
        const core::Pose& T = truth[static_cast<std::size_t>(k)];
        pairs.push_back(
            {core::TimeNs{k} + 1,
             {T.q * core::exp_quaternion(Eigen::Vector3d(e.segment<3>(6 * k + 3))), T.p + e.segment<3>(6 * k)},
             T});
      }
      const TrajectoryErrors errors = trajectory_errors(pairs, {.alignment = alignment});
      ASSERT_TRUE(errors.ok) << errors.reason;
      squares_p.push_back(errors.position_m.rmse * errors.position_m.rmse);
      squares_theta.push_back(std::pow(errors.rotation_deg.rmse / core::kDegreesPerRadian, 2));
    }
    // The mean square over the draws within 3 sigma of its own spread.
    const auto expect_mean = [&](const std::vector<double>& squares, double bound) {
      const Eigen::Map<const Eigen::ArrayXd> s(squares.data(), kDraws);
      const double sigma = std::sqrt((s - s.mean()).square().mean() / kDraws);
      EXPECT_NEAR(s.mean(), bound * bound, 3.0 * sigma) << kAlignmentNames[static_cast<std::size_t>(alignment)];
    };
    expect_mean(squares_p, b.position_m);
    expect_mean(squares_theta, b.rotation_rad);
  }
}

}  // namespace
}  // namespace plumbline::eval
