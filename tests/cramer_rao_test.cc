// The Cramer-Rao bound against brute force: the covariance that the batch estimator's own factors give at the truth,
// and Monte-Carlo draws of the linear model.
#include "eval/cramer_rao.h"

#include <cmath>
#include <vector>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include "core/random.h"
#include "estimator/batch_problem.h"
#include "estimator/factors/world_point.h"
#include "eval/metric_bound.h"
#include "eval/trajectory_error.h"
#include "sim/simulate.h"

namespace plumbline::eval {
namespace {

sim::ScenarioConfig small_scenario() {
  sim::ScenarioConfig c;
  c.duration_s = 2.5;
  c.trajectory.handheld.rate_rms_rad_s = 0.75;
  c.imu.noise = {1.7e-4, 2e-5, 2e-3, 3e-3};
  c.camera.td_s = 0.02;
  c.camera.readout_s = 0.03;
  c.points.per_frame = 12;
  // A prior whose mean is off the truth has a Jacobian that is off the identity by half as much.
  c.prior.means = sim::PriorMeans::kTruth;
  return c;
}

std::vector<std::size_t> every_second_frame(const core::MeasurementLog& log) {
  std::vector<std::size_t> frames;
  for (std::size_t i = 0; i < log.frames.size(); i += 2) frames.push_back(i);
  return frames;
}

// The truth as values of the batch problem. A landmark is taken in its anchor so that the model, not the trajectory,
// maps it to the true point: both sides then linearise at the same place to the last digit.
estimator::BatchValues true_values(const estimator::BatchInput& input, const sim::GroundTruth& truth) {
  const core::MeasurementLog& log = input.log;
  estimator::BatchValues values;
  values.calibration = truth.calibration;
  const auto sample_at = [&](core::TimeNs t_ns) {
    std::size_t best = 0;
    for (std::size_t i = 0; i < log.imu.size(); ++i) {
      if (std::abs(log.imu[i].t_ns - t_ns) < std::abs(log.imu[best].t_ns - t_ns)) best = i;
    }
    return best;
  };
  values.samples.push_back(0);
  for (const std::size_t k : input.keyframes) {
    values.samples.push_back(sample_at(log.frames[k].t_cam_ns + core::to_ns(truth.calibration.td_s)));
  }
  for (const std::size_t s : values.samples) values.states.push_back(truth.states[s].state);
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
    EXPECT_TRUE(view && estimator::body_at(*motion, state, log.gravity_m_s2, view->tau_s, body));
    const core::Pose T_W_C = core::Pose{Eigen::Quaterniond(body.R), body.p} * truth.calibration.T_B_C;
    const Eigen::Vector3d P_C = T_W_C.inverse() * P_W;
    values.landmarks.emplace_back(Eigen::Vector3d(P_C.x() / P_C.z(), P_C.y() / P_C.z(), 1.0 / P_C.z()));
  }
  return values;
}

class Bound : public ::testing::Test {
 protected:
  core::PosteriorCovariance brute_force(const estimator::EstimatorConfig& config) const {
    estimator::BatchInput input{.log = log(),
                                .config = config,
                                .noise = estimator::believed_noise(config, log().imu_noise, log().pixel_sigma_px),
                                .keyframes = every_second_frame(log()),
                                .tracks = {}};
    input.tracks = estimator::collect_tracks(log().frames, input.keyframes, log().camera);
    return *estimator::BatchProblem(input, true_values(input, simulation_.truth)).posterior_covariance();
  }
  CramerRaoBound bound(BoundOptions options) const {
    options.frames = every_second_frame(log());
    return cramer_rao_bound(log(), simulation_.truth, options);
  }
  const core::MeasurementLog& log() const { return simulation_.measurements; }

  sim::Simulation simulation_ = sim::simulate(small_scenario(), {3, 0});
};

// Each entry against the geometric mean of its diagonal ones.
void expect_same(const core::PosteriorCovariance& a, const core::PosteriorCovariance& b, double tolerance) {
  for (int r = 0; r < core::kCovDim; ++r) {
    for (int c = 0; c < core::kCovDim; ++c) {
      EXPECT_LE(std::abs(a(r, c) - b(r, c)), tolerance * std::sqrt(b(r, r) * b(c, c))) << r << " " << c;
    }
  }
}

// The factor stops its search of the row at 1e-5 px, which leaves 1e-9 of a derivative. (The chain alone meets a dense
// inverse to 1e-10: information_chain_test.)
TEST_F(Bound, EqualsTheDenseInverseAtTheTruth) { expect_same(bound({}).covariance, brute_force({}), 1e-8); }

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
  EXPECT_NEAR(core::kDegreesPerRadian * series.back().orientation_rad, *metric_bound(b, "final_orientation_deg"), 1e-6);
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
      for (int c = 0; c < J.cols(); ++c) J(r, c) = random.normal(100 + index, static_cast<std::uint64_t>(12 * r + c));
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
