#include "eval/relative_error.h"

#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "core/error.h"
#include "core/lie.h"
#include "eval/attitude_error.h"

namespace plumbline::eval {
namespace {

constexpr core::TimeNs kStep = 100'000'000;
constexpr double kDegree = std::numbers::pi / 180.0;

Eigen::Quaterniond turn(double x, double y, double z) { return core::exp_quaternion(Eigen::Vector3d(x, y, z)); }

// 101 poses, 0.1 s and 0.2 m apart along x with a slow roll; 20 m and 10 s.
std::vector<PosePair> straight() {
  std::vector<PosePair> pairs;
  for (int k = 0; k <= 100; ++k) {
    const core::Pose T{turn(0.01 * k, 0.0, 0.0), {0.2 * k, 0.0, 0.0}};
    pairs.push_back({k * kStep, T, T});
  }
  return pairs;
}

TEST(AttitudeError, SplitsIntoTurnAndTilt) {
  const Eigen::Quaterniond truth = turn(0.4, -1.0, 2.0);
  const AttitudeError turned = attitude_error(turn(0.0, 0.0, -0.7) * truth, truth);
  EXPECT_NEAR(turned.yaw_rad, -0.7, 1e-14);
  EXPECT_NEAR(turned.gravity_rad, 0.0, 1e-14);
  const AttitudeError tilted = attitude_error(turn(0.3, -0.4, 0.0) * truth, truth);
  EXPECT_NEAR(tilted.yaw_rad, 0.0, 1e-14);
  EXPECT_NEAR(tilted.gravity_rad, 0.5, 1e-14);
  for (const double sign : {1.0, -1.0}) {  // q and -q are the same rotation
    Eigen::Quaterniond both = turn(0.0, 0.0, 1.2) * turn(0.2, 0.1, 0.0) * truth;
    both.coeffs() *= sign;
    const AttitudeError e = attitude_error(both, truth);
    EXPECT_NEAR(e.yaw_rad, 1.2, 1e-14);
    EXPECT_NEAR(e.gravity_rad, std::hypot(0.2, 0.1), 1e-14);
    EXPECT_NEAR(std::cos(0.5 * core::rotation_angle(both * truth.conjugate())),
                std::cos(0.5 * e.yaw_rad) * std::cos(0.5 * e.gravity_rad), 1e-14);
  }
  // Gravity is seen from the body: a turn of the body about its own z is a tilt where that is not upright.
  EXPECT_NEAR(
      attitude_error(turn(std::numbers::pi / 2, 0, 0) * turn(0, 0, 0.3), turn(std::numbers::pi / 2, 0, 0)).gravity_rad,
      0.3, 1e-14);
}

TEST(RelativeError, DriftByHand) {
  std::vector<PosePair> pairs = straight();
  // 1 % too long, and yaw that drifts by 0.1 degrees a pose.
  for (int k = 0; k <= 100; ++k) {
    pairs[k].estimate.p.x() *= 1.01;
    pairs[k].estimate.q = turn(0.0, 0.0, 0.1 * kDegree * k) * pairs[k].truth.q;
  }
  const RelativeErrors rotation = relative_errors(pairs, {10, DeltaUnit::kFrames});
  EXPECT_EQ(rotation.pairs, 91);
  EXPECT_NEAR(rotation.yaw_deg.max, 1.0, 1e-9);
  EXPECT_NEAR(rotation.rotation_deg.min, 1.0, 1e-9);
  EXPECT_NEAR(rotation.gravity_deg.max, 0.0, 1e-9);

  pairs = straight();
  for (PosePair& pair : pairs) pair.estimate.p.x() *= 1.01;
  for (const Delta& delta : {Delta{4.0, DeltaUnit::kMetres}, Delta{20.0, DeltaUnit::kPercentOfPath},
                             Delta{2.0, DeltaUnit::kSeconds}, Delta{20.0, DeltaUnit::kFrames}}) {
    const RelativeErrors e = relative_errors(pairs, delta);
    EXPECT_EQ(e.pairs, 81) << to_string(delta);
    EXPECT_NEAR(e.position_m.rmse, 0.04, 1e-12) << to_string(delta);
  }
  EXPECT_EQ(relative_errors(pairs, {4.0, DeltaUnit::kMetres}, PairStarts::kConsecutive).pairs, 5);
}

// Expressed in the world, a tilt of the estimate's attitude error stays a tilt whatever the body's attitude.
TEST(RelativeError, YawAndGravityAreThoseOfTheWorld) {
  std::vector<PosePair> pairs(2);
  pairs[0] = {0, {}, {}};
  pairs[1].t_ns = kStep;
  pairs[1].truth.q = turn(1.1, 0.4, -0.8);
  pairs[1].estimate.q = turn(0.02, 0.0, 0.0) * pairs[1].truth.q;
  const RelativeErrors tilt = relative_errors(pairs, {1, DeltaUnit::kFrames});
  EXPECT_NEAR(tilt.gravity_deg.rmse, 0.02 / kDegree, 1e-9);
  EXPECT_NEAR(tilt.yaw_deg.rmse, 0.0, 1e-9);
  EXPECT_NEAR(tilt.rotation_deg.rmse, 0.02 / kDegree, 1e-9);
}

// The position error is that of the motion seen from the first pose: a heading error there moves the end of it.
TEST(RelativeError, IsFreeOfARigidMotionAndSeesTheHeading) {
  std::vector<PosePair> pairs = straight();
  const core::Pose T{turn(0.3, -0.2, 1.0), {1.0, 2.0, 3.0}};
  for (PosePair& pair : pairs) pair.estimate = T * pair.estimate;
  EXPECT_LT(relative_errors(pairs, {10.0, DeltaUnit::kMetres}).position_m.max, 1e-12);
  pairs = straight();
  pairs[0].estimate.q = turn(0.0, 0.0, 0.1);
  EXPECT_NEAR(relative_errors(pairs, {100, DeltaUnit::kFrames}).position_m.max, 2.0 * 20.0 * std::sin(0.05), 1e-9);
}

TEST(RelativeError, PairsAreNearDeltaOrNone) {
  const std::vector<PosePair> pairs = straight();
  EXPECT_EQ(relative_errors(pairs, {0.19, DeltaUnit::kMetres}).pairs, 100);  // 0.2 m is within a tenth
  EXPECT_EQ(relative_errors(pairs, {0.15, DeltaUnit::kMetres}).pairs, 0);    // neither 0 nor 0.2 m
  EXPECT_EQ(relative_errors(pairs, {30.0, DeltaUnit::kMetres}).pairs, 0);    // longer than the path
  EXPECT_EQ(relative_errors(pairs, {11.5, DeltaUnit::kSeconds}).pairs, 0);   // longer than the recording
  EXPECT_EQ(relative_errors(pairs, {101, DeltaUnit::kFrames}).pairs, 0);
  std::vector<PosePair> rest = pairs;
  for (PosePair& pair : rest) pair.truth.p.setZero();
  EXPECT_EQ(relative_errors(rest, {10.0, DeltaUnit::kPercentOfPath}).pairs, 0);
  const nlohmann::ordered_json json = to_json(relative_errors(pairs, {30.0, DeltaUnit::kMetres}));
  EXPECT_EQ(json.at("delta"), "30m");
  EXPECT_EQ(json.at("pairs"), 0);
  EXPECT_FALSE(json.contains("position_m"));  // never an error of 0
}

TEST(RelativeError, DeltasAreReadAsWritten) {
  const std::vector<Delta> deltas = parse_deltas("10m,0.5s,20f,12.5%");
  ASSERT_EQ(deltas.size(), 4U);
  std::string text;
  for (const Delta& delta : deltas) text += to_string(delta) + ' ';
  EXPECT_EQ(text, "10m 0.5s 20f 12.5% ");
  for (const char* bad : {"", "10", "m", "0m", "-1s", "nans", "1.5f", "101%", "1m,", "1m,,2m", "1 m", "1x"}) {
    EXPECT_THROW(parse_deltas(bad), core::DataError) << bad;
  }
  EXPECT_EQ(parse_deltas(kDefaultDeltas).size(), 6U);
}

}  // namespace
}  // namespace plumbline::eval
