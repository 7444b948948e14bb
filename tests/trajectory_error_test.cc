#include "eval/trajectory_error.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "core/lie.h"
#include "core/pose_file.h"

namespace plumbline::eval {
namespace {

using core::Pose;
using core::StampedPose;
using Poses = std::vector<StampedPose>;

constexpr core::TimeNs kMs = 1'000'000;
constexpr core::TimeNs kFarApart = core::kNsPerSecond;  // too far apart to interpolate between

// n poses `interval` apart on a curve without symmetry, a function of time alone.
Poses path(int n, core::TimeNs interval = 50 * kMs, core::TimeNs start = 0) {
  Poses poses;
  poses.reserve(n);
  for (int k = 0; k < n; ++k) {
    const core::TimeNs t_ns = start + k * interval;
    const double u = core::to_seconds(t_ns);
    poses.push_back(
        {t_ns,
         {core::exp_quaternion(Eigen::Vector3d(0.3 * u, -0.2, 0.5 * u)), {std::cos(u), std::sin(1.3 * u), 0.3 * u}}});
  }
  return poses;
}

std::vector<PosePair> pairs_of(const Poses& estimate, const Poses& truth) {
  std::vector<PosePair> pairs;
  pairs.reserve(truth.size());
  for (std::size_t k = 0; k < truth.size(); ++k) pairs.push_back({truth[k].t_ns, estimate[k].T_W_B, truth[k].T_W_B});
  return pairs;
}

TEST(TrajectoryError, StatisticsByHand) {
  const ErrorStatistics s = error_statistics({4.0, 1.0, 3.0, 2.0});
  EXPECT_DOUBLE_EQ(s.rmse, std::sqrt(7.5));
  EXPECT_DOUBLE_EQ(s.mean, 2.5);
  EXPECT_DOUBLE_EQ(s.median, 2.5);
  EXPECT_DOUBLE_EQ(s.std, std::sqrt(1.25));  // of the population; of the sample it would be sqrt(5/3)
  EXPECT_EQ(s.min, 1.0);
  EXPECT_EQ(s.max, 4.0);
}

// The octahedron stretched along x by 1.2 and the bodies turned by 10 degrees (tests/alignment_test.cc).
TEST(TrajectoryError, PairByHand) {
  std::vector<PosePair> pairs;
  for (int k = 0; k < 6; ++k) {
    PosePair pair{k, {}, {}};
    pair.truth.p(k / 2) = k % 2 == 0 ? 1.0 : -1.0;
    pair.estimate = pair.truth;
    pair.estimate.p.x() *= 1.2;
    pair.estimate.q = core::exp_quaternion(Eigen::Vector3d(0.0, std::numbers::pi / 18.0, 0.0));
    pairs.push_back(pair);
  }
  for (const Alignment alignment : {Alignment::kNone, Alignment::kPosyaw, Alignment::kSe3}) {
    const TrajectoryErrors e = trajectory_errors(pairs, {.alignment = alignment});
    ASSERT_TRUE(e.ok) << e.reason;
    EXPECT_NEAR(e.position_m.rmse, std::sqrt(0.08 / 6.0), 1e-14);
    EXPECT_NEAR(e.position_m.median, 0.0, 1e-14);
    EXPECT_NEAR(e.position_m.max, 0.2, 1e-14);
    EXPECT_NEAR(e.rotation_deg.rmse, 10.0, 1e-12);
  }
  const double s = 6.4 / 6.88;
  const TrajectoryErrors e = trajectory_errors(pairs, {.alignment = Alignment::kSim3});
  ASSERT_TRUE(e.ok) << e.reason;
  EXPECT_NEAR(e.position_m.max, 1.2 * s - 1.0, 1e-14);
  EXPECT_NEAR(e.position_m.min, 1.0 - s, 1e-14);
  EXPECT_NEAR(e.rotation_deg.rmse, 10.0, 1e-12);
}

TEST(TrajectoryError, ErrorsArePerturbationsOfTheTruth) {
  const Poses truth = path(10);
  Poses estimate = truth;
  const Eigen::Vector3d dp(0.01, -0.02, 0.03);
  const Eigen::Vector3d dtheta(0.02, 0.01, -0.03);
  for (auto& pose : estimate) {
    pose.T_W_B.p += dp;
    pose.T_W_B.q = pose.T_W_B.q * core::exp_quaternion(dtheta);
  }
  const TrajectoryErrors e = trajectory_errors(pairs_of(estimate, truth), {.alignment = Alignment::kNone});
  ASSERT_TRUE(e.ok);
  for (const PoseError& error : e.errors) {
    EXPECT_LT((error.position_m - dp).norm(), 1e-14);
    EXPECT_LT((error.rotation_rad - dtheta).norm(), 1e-14);
  }
}

TEST(TrajectoryError, AlignmentTurnsOrientationsToo) {
  const Poses truth = path(50);
  Poses estimate = truth;
  const Pose T_E_W{core::exp_quaternion(Eigen::Vector3d(0.0, 0.0, 2.0)), {5.0, 6.0, 7.0}};
  for (auto& pose : estimate) pose.T_W_B = T_E_W * pose.T_W_B;
  const TrajectoryErrors e = trajectory_errors(estimate, truth);
  ASSERT_TRUE(e.ok);
  EXPECT_LT(e.position_m.max, 1e-12);
  EXPECT_LT(e.rotation_deg.max, 1e-12);
  EXPECT_NEAR(trajectory_errors(estimate, truth, {.alignment = Alignment::kNone}).rotation_deg.mean,
              2.0 * core::kDegreesPerRadian, 1e-9);
}

TEST(Association, RatesMayDiffer) {
  const Poses dense = path(1000, 5 * kMs);
  const Poses sparse = path(100, 50 * kMs);
  const Association a = associate(sparse, dense);
  EXPECT_EQ(a.pairs.size(), 100U);
  EXPECT_EQ(a.interpolated, 0);
  EXPECT_GE(a.coverage, 0.99);  // a denser truth goes on after the last estimate
  for (const PosePair& pair : a.pairs) EXPECT_EQ(pair.estimate.p, pair.truth.p);

  const Association b = associate(dense, sparse);
  EXPECT_EQ(b.pairs.size(), 991U);  // the last nine lie after the last true pose
  EXPECT_EQ(b.interpolated, 891);
  EXPECT_EQ(b.coverage, 1.0);
  EXPECT_DOUBLE_EQ(b.largest_bridged_s, 0.05);
}

// Half way between two poses the chord is a dt^2 / 8 inside the curve; its attitude is half way too.
TEST(Association, InterpolatesTheTruthAtTheEstimatesStamps) {
  const Poses truth = path(100, 20 * kMs);
  const Poses estimate = path(99, 20 * kMs, 10 * kMs);
  const Association a = associate(estimate, truth);
  ASSERT_EQ(a.pairs.size(), 99U);
  EXPECT_EQ(a.interpolated, 99);
  double largest = 0.0;
  for (const PosePair& pair : a.pairs) {
    const Eigen::Vector3d error = pair.truth.p - pair.estimate.p;
    largest = std::max(largest, error.norm());
    EXPECT_LT(core::rotation_angle(pair.truth.q.conjugate() * pair.estimate.q), 1e-5);
  }
  // Accelerations of the path: at most 1 and 1.69 m/s^2 on x and y.
  EXPECT_LT(largest, std::hypot(1.0, 1.69) * 0.02 * 0.02 / 8.0);
  EXPECT_GT(largest, 1.0 * 0.02 * 0.02 / 8.0);
}

TEST(Association, DoesNotBridgeGapsOfTheTruth) {
  Poses truth = path(100, 20 * kMs);
  truth.erase(truth.begin() + 41, truth.begin() + 50);  // from 0.80 s to 1.00 s: 0.2 s, bridged
  truth.erase(truth.begin() + 61, truth.begin() + 71);  // from 1.38 s to 1.60 s: 0.22 s
  const Association a = associate(path(100, 20 * kMs), truth);
  EXPECT_EQ(a.interpolated, 9);
  EXPECT_DOUBLE_EQ(a.largest_bridged_s, 0.2);
  EXPECT_EQ(a.pairs.size(), 90U);
  EXPECT_EQ(a.coverage, 1.0);  // gaps of the truth are not the estimate's fault
}

TEST(Association, IsOneToOneAndTheNearerWins) {
  const Poses truth = path(3, kFarApart);
  Poses estimate = truth;
  estimate[1].t_ns -= 300'000;
  StampedPose nearer = estimate[1];
  nearer.t_ns = truth[1].t_ns + 200'000;
  nearer.T_W_B.p.setConstant(42.0);
  estimate.insert(estimate.begin() + 2, nearer);
  const Association a = associate(estimate, truth);
  ASSERT_EQ(a.pairs.size(), 3U);
  EXPECT_EQ(a.pairs[1].estimate.p.x(), 42.0);
  EXPECT_EQ(a.pairs[1].estimate_index, 2U);
  EXPECT_EQ(a.pairs[1].truth.p, truth[1].T_W_B.p);

  estimate[2].t_ns = truth[1].t_ns;  // an exact one wins over a near one
  ASSERT_EQ(associate(estimate, truth).pairs.size(), 3U);
  EXPECT_EQ(associate(estimate, truth).pairs[1].t_ns, truth[1].t_ns);
}

TEST(Association, KeepsWithinTheTolerance) {
  const Poses truth = path(100, kFarApart);
  EXPECT_EQ(associate(path(100, kFarApart, 500'000), truth).pairs.size(), 100U);
  EXPECT_EQ(associate(path(100, kFarApart, 500'001), truth).pairs.size(), 0U);
  EXPECT_EQ(associate(path(100, kFarApart, 2 * kMs), truth, 2 * kMs).pairs.size(), 100U);
  EXPECT_EQ(associate(path(100, kFarApart, 2 * kMs), truth).coverage, 0.0);
}

TEST(Association, CoverageFallsWithEveryWayToMissPoses) {
  const Poses truth = path(1000, 5 * kMs);
  const auto coverage = [&](const Poses& estimate) { return associate(estimate, truth).coverage; };
  EXPECT_NEAR(coverage(path(50)), 0.5, 0.01);                         // stops half way
  EXPECT_NEAR(coverage(path(50, 50 * kMs, 2'500 * kMs)), 0.5, 0.01);  // starts half way
  Poses gap = path(100);
  gap.erase(gap.begin() + 30, gap.begin() + 60);
  EXPECT_NEAR(coverage(gap), 0.7, 0.02);
  EXPECT_EQ(coverage(path(100, 50 * kMs, 10'000 * kMs)), 0.0);  // another time altogether
}

TEST(TrajectoryError, StatesWhereTheTruthComesFrom) {
  EXPECT_EQ(to_json(trajectory_errors(path(100), path(100)), Alignment::kPosyaw).at("truth"), "exact");
  const auto json = to_json(trajectory_errors(path(99, 50 * kMs, 20 * kMs), path(100)), Alignment::kPosyaw);
  EXPECT_EQ(json.at("truth"), "interpolated");
  EXPECT_DOUBLE_EQ(json.at("largest_bridged_s").get<double>(), 0.05);
}

// Of the first poses and of the first seconds; what comes later drifts and must not matter.
TEST(TrajectoryError, AlignsByTheFirst) {
  const Poses truth = path(100);
  Poses estimate = truth;
  const Pose T_E_W{core::exp_quaternion(Eigen::Vector3d(0.0, 0.0, 1.0)), {5.0, 6.0, 7.0}};
  for (std::size_t k = 0; k < estimate.size(); ++k) {
    if (k > 20) estimate[k].T_W_B.p.x() += 1.0;
    estimate[k].T_W_B = T_E_W * estimate[k].T_W_B;
  }
  for (const TrajectoryErrorOptions& options :
       {TrajectoryErrorOptions{.first_n = 21}, TrajectoryErrorOptions{.first_s = 1.0}}) {
    const TrajectoryErrors e = trajectory_errors(estimate, truth, options);
    ASSERT_TRUE(e.ok) << e.reason;
    EXPECT_LT(e.errors[20].position_m.norm(), 1e-12);
    EXPECT_NEAR(e.errors[21].position_m.norm(), 1.0, 1e-12);
  }
  EXPECT_GT(trajectory_errors(estimate, truth, {.first_s = 1.06}).errors[0].position_m.norm(), 1e-3);
  EXPECT_THROW(trajectory_errors(estimate, truth, {.first_n = 5, .first_s = 1.0}), std::invalid_argument);
}

TEST(TrajectoryError, FailsWithAReasonNeverWithZero) {
  const Poses truth = path(100);
  const auto reason = [&](const Poses& estimate, Alignment alignment = Alignment::kPosyaw) {
    const TrajectoryErrors e = trajectory_errors(estimate, truth, {.alignment = alignment});
    EXPECT_FALSE(e.ok);
    EXPECT_TRUE(e.errors.empty());
    return e.reason;
  };
  Poses broken = truth;
  broken[7].T_W_B.p.z() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(reason(broken), "the estimate's pose 7 is not finite");
  broken = truth;
  broken[7].T_W_B.q.w() = std::numeric_limits<double>::infinity();
  EXPECT_EQ(reason(broken), "the estimate's pose 7 is not finite");
  broken = truth;
  broken[8].t_ns = broken[7].t_ns;
  EXPECT_EQ(reason(broken), "the estimate's pose 8 has a duplicate stamp");
  std::swap(broken[3].t_ns, broken[4].t_ns);
  EXPECT_EQ(reason(broken), "the estimate's pose 4 has an unsorted stamp");
  EXPECT_EQ(reason(path(89)).substr(0, 8), "coverage");
  EXPECT_EQ(reason({}).substr(0, 8), "coverage");
  broken = truth;
  for (auto& pose : broken) pose.T_W_B.p *= 1e200;
  EXPECT_EQ(reason(broken, Alignment::kNone), "the errors overflow");

  EXPECT_TRUE(trajectory_errors(path(95), truth).ok);
  EXPECT_EQ(trajectory_errors(path(2), path(2), {.alignment = Alignment::kNone}).reason, "2 poses where 3 are needed");
}

TEST(TrajectoryError, JsonTellsOkFromFailed) {
  const auto ok = to_json(trajectory_errors(path(10), path(10)), Alignment::kPosyaw);
  EXPECT_EQ(ok.at("alignment"), "posyaw");
  EXPECT_EQ(ok.at("matched"), 10);
  EXPECT_EQ(ok.at("coverage"), 1.0);
  EXPECT_TRUE(ok.at("ate_position_m").contains("rmse"));
  const auto failed = to_json(trajectory_errors(path(5), path(10)), Alignment::kSe3);
  EXPECT_FALSE(failed.at("ok").get<bool>());
  EXPECT_TRUE(failed.contains("reason"));
  EXPECT_FALSE(failed.contains("ate_position_m"));
}

// Twelve pairs against evo 1.36.5 and the aligner of rpg_trajectory_evaluation; figures to full precision.
TEST(TrajectoryError, AgreesWithEvoAndRpg) {
  const std::filesystem::path folder = std::filesystem::path(PLUMBLINE_SOURCE_DIR) / "tests/data/evaluation";
  std::ifstream file(folder / "reference.json");
  const nlohmann::json reference = nlohmann::json::parse(file);
  ASSERT_EQ(reference.size(), 12U);

  constexpr double kRelative = 1e-9;
  const auto expect_near = [&](double value, double expected, const std::string& what) {
    EXPECT_NEAR(value, expected, kRelative * std::abs(expected)) << what;
  };
  const auto expect_statistics = [&](const ErrorStatistics& s, const nlohmann::json& expected,
                                     const std::string& what) {
    expect_near(s.rmse, expected.at("rmse"), what + " rmse");
    expect_near(s.mean, expected.at("mean"), what + " mean");
    expect_near(s.median, expected.at("median"), what + " median");
    expect_near(s.std, expected.at("std"), what + " std");
    expect_near(s.min, expected.at("min"), what + " min");
    expect_near(s.max, expected.at("max"), what + " max");
  };
  for (const auto& [pair, expected] : reference.items()) {
    const Poses truth = core::read_tum(folder / (pair + "_truth.tum"));
    const Poses estimate = core::read_tum(folder / (pair + "_estimate.tum"));
    for (const Alignment alignment : {Alignment::kNone, Alignment::kSe3, Alignment::kSim3}) {
      const std::string name(kAlignmentNames[static_cast<std::size_t>(alignment)]);
      const TrajectoryErrors e = trajectory_errors(estimate, truth, {.alignment = alignment});
      ASSERT_TRUE(e.ok) << e.reason;
      EXPECT_EQ(e.matched, 300);
      EXPECT_EQ(e.coverage, 1.0);
      expect_statistics(e.position_m, expected.at("ate_position_m/" + name), fmt::format("{} position {}", pair, name));
      expect_statistics(e.rotation_deg, expected.at("ate_rotation_deg/" + name),
                        fmt::format("{} rotation {}", pair, name));
    }
    for (const Alignment alignment : {Alignment::kPosyaw, Alignment::kSe3, Alignment::kSim3}) {
      const std::string name = "rpg/" + std::string(kAlignmentNames[static_cast<std::size_t>(alignment)]);
      const nlohmann::json& rpg = expected.at(name);
      const TrajectoryErrors e = trajectory_errors(estimate, truth, {.alignment = alignment});
      ASSERT_TRUE(e.ok) << e.reason;
      const Similarity& S = e.truth_from_estimate;
      expect_near(e.position_m.rmse, rpg.at("ate_pos_rmse"), fmt::format("{} {} position", pair, name));
      expect_near(e.rotation_deg.rmse, rpg.at("ate_rot_deg_rmse"), fmt::format("{} {} rotation", pair, name));
      expect_near(S.s, rpg.at("scale"), fmt::format("{} {} scale", pair, name));
      if (alignment == Alignment::kPosyaw) {
        expect_near(std::atan2(S.R(1, 0), S.R(0, 0)) * core::kDegreesPerRadian, rpg.at("yaw_deg"), pair + " yaw");
      }
      for (int i = 0; i < 3; ++i) expect_near(S.t(i), rpg.at("t").at(i), fmt::format("{} {} t", pair, name));
    }

    const std::vector<PosePair> pairs = pairs_of(estimate, truth);
    const RelativeErrors one = relative_errors(pairs, {1, DeltaUnit::kFrames});
    EXPECT_EQ(one.pairs, 299);
    expect_statistics(one.position_m, expected.at("rpe_1frame_position_m"), pair + " 1 frame");
    const RelativeErrors all = relative_errors(pairs, {20, DeltaUnit::kFrames});
    EXPECT_EQ(all.pairs, 280);
    expect_statistics(all.position_m, expected.at("rpe_20frames_position_m_all_pairs"), pair + " 20 frames");
    const RelativeErrors some = relative_errors(pairs, {20, DeltaUnit::kFrames}, PairStarts::kConsecutive);
    EXPECT_EQ(some.pairs, 14);
    expect_statistics(some.rotation_deg, expected.at("rpe_20frames_rotation_deg_consecutive"), pair + " consecutive");
  }
}

}  // namespace
}  // namespace plumbline::eval
