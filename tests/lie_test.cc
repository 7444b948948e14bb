#include "core/lie.h"

#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include <Eigen/Dense>
#include <ceres/manifold_test_utils.h>
#include <gtest/gtest.h>

#include "core/so3_manifold.h"
#include "core/state.h"

namespace plumbline::core {
namespace {

constexpr double kPi = std::numbers::pi;

// From tiny to nearly pi, and on both sides of where series take over: |theta|^2 in Exp and the Jacobians,
// sin^2(|theta|/2) in Log.
std::vector<double> angles() {
  const double exp_switch = std::sqrt(detail::kSmallAngleSquared);
  const double log_switch = 2.0 * std::asin(std::sqrt(detail::kSmallAngleSquared));
  return {1e-12,
          1e-8,
          1e-4,
          exp_switch * (1.0 - 1e-9),
          exp_switch * (1.0 + 1e-9),
          0.05,
          log_switch * (1.0 - 1e-9),
          log_switch * (1.0 + 1e-9),
          0.5,
          1.0,
          2.0,
          3.0,
          kPi - 1e-6};
}

std::array<Eigen::Vector3d, 4> axes() {
  return {Eigen::Vector3d::UnitX(), Eigen::Vector3d::UnitY(), Eigen::Vector3d(0.0, 0.6, -0.8),
          Eigen::Vector3d(-0.48, 0.64, 0.6)};
}

// Central difference of fourth order. With h = 1e-3 and derivatives of order 1 the truncation is h^4 and the rounding
// 1e-16/h: 1e-12 together, so that 1e-10 leaves room and any wrong term shows.
constexpr double kDifferenceTolerance = 1e-10;
template <class F>
Eigen::Matrix3d numeric_jacobian(const F& f) {
  constexpr double kStep = 1e-3;
  Eigen::Matrix3d J;
  for (int i = 0; i < 3; ++i) {
    const auto at = [&](double s) -> Eigen::Vector3d { return f(s * kStep * Eigen::Vector3d::Unit(i)); };
    J.col(i) = (8.0 * (at(1.0) - at(-1.0)) - (at(2.0) - at(-2.0))) / (12.0 * kStep);
  }
  return J;
}

TEST(Lie, SkewIsTheCrossProduct) {
  const Eigen::Vector3d a(1.0, 2.0, 3.0);
  const Eigen::Vector3d b(-0.5, 0.25, 4.0);
  EXPECT_EQ(skew(a) * b, a.cross(b));
  EXPECT_EQ((skew(Eigen::Vector3d::UnitX()) * Eigen::Vector3d::UnitY()), Eigen::Vector3d::UnitZ());
}

TEST(Lie, ExpIsTheRotationByTheWholeAngle) {
  for (const double angle : angles()) {
    for (const Eigen::Vector3d& axis : axes()) {
      const Eigen::Quaterniond expected(Eigen::AngleAxisd(angle, axis));
      // Rounding of four numbers below 1.
      EXPECT_LT((exp_quaternion(angle * axis).coeffs() - expected.coeffs()).norm(), 1e-15) << angle;
      EXPECT_LT((exp_so3(angle * axis) - expected.toRotationMatrix()).norm(), 4e-15) << angle;
    }
  }
  // Counter-clockwise: a quarter turn about z takes x to y.
  const Eigen::Vector3d turned = exp_so3(0.5 * kPi * Eigen::Vector3d::UnitZ()) * Eigen::Vector3d::UnitX();
  EXPECT_LT((turned - Eigen::Vector3d::UnitY()).norm(), 1e-15);
  EXPECT_EQ(exp_quaternion(Eigen::Vector3d::Zero().eval()).coeffs(), Eigen::Quaterniond::Identity().coeffs());
}

TEST(Lie, LogInvertsExp) {
  for (const double angle : angles()) {
    for (const Eigen::Vector3d& axis : axes()) {
      const Eigen::Vector3d theta = angle * axis;
      const Eigen::Quaterniond q = exp_quaternion(theta);
      // A few roundings, relative to the angle: tiny ones keep all their digits.
      EXPECT_LT((log_so3(q) - theta).norm(), 4e-15 * angle) << angle;
      EXPECT_EQ(log_so3(Eigen::Quaterniond(-q.coeffs())), log_so3(q)) << angle;
      EXPECT_NEAR(rotation_angle(q), angle, 4e-15 * angle);
    }
  }
  // Beyond pi the shorter way round.
  EXPECT_LT(
      (log_so3(exp_quaternion(4.0 * Eigen::Vector3d::UnitX())) - (4.0 - 2.0 * kPi) * Eigen::Vector3d::UnitX()).norm(),
      1e-14);
  EXPECT_EQ(log_so3(Eigen::Quaterniond::Identity()), Eigen::Vector3d::Zero());
}

TEST(Lie, RightJacobianMatchesDifferences) {
  for (const double angle : angles()) {
    for (const Eigen::Vector3d& axis : axes()) {
      const Eigen::Vector3d theta = angle * axis;
      const Eigen::Quaterniond inverse = exp_quaternion(-theta);
      const Eigen::Matrix3d numeric =
          numeric_jacobian([&](const Eigen::Vector3d& d) { return log_so3(inverse * exp_quaternion(theta + d)); });
      EXPECT_LT((right_jacobian(theta) - numeric).norm(), kDifferenceTolerance) << angle;
    }
  }
}

TEST(Lie, RightJacobianInverseMatchesDifferences) {
  for (const double angle : angles()) {
    if (angle > 3.0) continue;  // Log jumps at pi
    for (const Eigen::Vector3d& axis : axes()) {
      const Eigen::Vector3d theta = angle * axis;
      const Eigen::Quaterniond q = exp_quaternion(theta);
      const Eigen::Matrix3d numeric =
          numeric_jacobian([&](const Eigen::Vector3d& d) { return log_so3(q * exp_quaternion(d)); });
      EXPECT_LT((right_jacobian_inverse(theta) - numeric).norm(), kDifferenceTolerance) << angle;
    }
  }
}

// Identities that hold to rounding: what the differences cannot see, such as a series with a wrong last term.
TEST(Lie, JacobianIdentities) {
  for (const double angle : angles()) {
    for (const Eigen::Vector3d& axis : axes()) {
      const Eigen::Vector3d theta = angle * axis;
      const Eigen::Matrix3d J = right_jacobian(theta);
      // (1 - cos)/angle^2 loses 1e-16/1e-3 just above the series, which multiplies an angle of 0.03.
      EXPECT_LT((exp_so3(theta) * J - left_jacobian(theta)).norm(), 4e-14) << angle;
      EXPECT_EQ(left_jacobian(theta), right_jacobian(-theta)) << angle;
      EXPECT_LT((J * theta - theta).norm(), 4e-15 * angle) << angle;
      // 1 + cos(angle) has an error of 1e-16 within 1e-6 of pi, over 2 pi sin(angle) = 6e-6, times |theta|^2 = 10.
      const double tolerance = angle > 3.1 ? 1e-9 : 1e-13;
      EXPECT_LT((J * right_jacobian_inverse(theta) - Eigen::Matrix3d::Identity()).norm(), tolerance) << angle;
      const Eigen::Vector3d x(0.3, -1.0, 2.0);
      EXPECT_LT((right_jacobian_times(theta, x) - J * x).norm(), 4e-15) << angle;
    }
  }
}

TEST(Lie, SeriesJoinTheClosedForms) {
  const double angle2 = detail::kSmallAngleSquared;
  const RotationCoefficients series = rotation_coefficients(angle2 * (1.0 - 1e-12));
  const long double angle = std::sqrt(static_cast<long double>(angle2));
  // Long double: 1e-19/angle^3 = 3e-15. The series leave out angle^8/10! = 3e-19.
  EXPECT_NEAR(series.b, static_cast<double>((1.0L - std::cos(angle)) / (angle * angle)), 2e-14);
  EXPECT_NEAR(series.c, static_cast<double>((angle - std::sin(angle)) / (angle * angle * angle)), 2e-14);
}

TEST(Lie, PosesComposeAsMatrices) {
  const auto matrix = [](const Pose& T) {
    Eigen::Matrix4d M = Eigen::Matrix4d::Identity();
    M.topLeftCorner<3, 3>() = T.q.toRotationMatrix();
    M.topRightCorner<3, 1>() = T.p;
    return M;
  };
  const Pose T_W_B{exp_quaternion(Eigen::Vector3d(0.4, -1.1, 0.7)), {1.0, -2.0, 0.5}};
  const Pose T_B_C{exp_quaternion(Eigen::Vector3d(-2.0, 0.3, 0.1)), {0.1, 0.2, -0.3}};
  EXPECT_LT((matrix(T_W_B * T_B_C) - matrix(T_W_B) * matrix(T_B_C)).norm(), 1e-14);
  EXPECT_LT((matrix(T_W_B.inverse()) - matrix(T_W_B).inverse()).norm(), 1e-14);
  EXPECT_LT((matrix(T_W_B * T_W_B.inverse()) - Eigen::Matrix4d::Identity()).norm(), 1e-14);
  const Eigen::Vector3d x_C(3.0, -1.0, 2.0);
  EXPECT_LT((T_W_B * (T_B_C * x_C) - (T_W_B * T_B_C) * x_C).norm(), 1e-14);
  EXPECT_EQ(T_W_B * Eigen::Vector3d::Zero(), T_W_B.p);
}

TEST(So3Manifold, InvariantsHold) {
  using namespace ceres;  // the macro's names
  const So3Manifold manifold;
  // Ridders' differences are good to about 1e-11.
  constexpr double kTolerance = 1e-9;
  for (const double angle : {1e-4, 0.02, 0.5, 2.0, 3.0}) {
    for (const Eigen::Vector3d& axis : axes()) {
      const Vector x = exp_quaternion(Eigen::Vector3d(-0.7, 2.0, angle)).coeffs();
      const Vector y = exp_quaternion(Eigen::Vector3d(0.2 + angle, 1.0, -0.4)).coeffs();
      const Vector delta = angle * axis;
      // Plus(x, Minus(y, x)) may be -y, the same rotation: choose the y that it is not.
      const Vector y_near = x.dot(y) < 0.0 ? Vector(-y) : y;
      EXPECT_THAT_MANIFOLD_INVARIANTS_HOLD(manifold, x, delta, y_near, kTolerance);
    }
  }
}

TEST(So3Manifold, PerturbsOnTheRightByTheWholeAngle) {
  const Eigen::Quaterniond q = exp_quaternion(Eigen::Vector3d(0.5, -0.8, 1.2));
  const Eigen::Vector3d axis(0.0, 0.6, 0.8);
  const Eigen::Vector3d delta = 0.3 * axis;
  Eigen::Quaterniond plus;
  ASSERT_TRUE(So3Manifold().Plus(q.coeffs().data(), delta.data(), plus.coeffs().data()));
  const auto distance = [&](const Eigen::Quaterniond& other) { return rotation_angle(plus.conjugate() * other); };
  EXPECT_LT(distance(q * Eigen::AngleAxisd(0.3, axis)), 1e-15);
  EXPECT_GT(distance(Eigen::AngleAxisd(0.3, axis) * q), 0.1);
  EXPECT_GT(distance(q * Eigen::AngleAxisd(0.6, axis)), 0.1);
}

State some_state() {
  return {.T_W_B = {exp_quaternion(Eigen::Vector3d(0.4, -1.1, 0.7)), {1.0, -2.0, 0.5}},
          .v_W = {0.3, 0.2, -0.1},
          .bias = {{0.01, -0.02, 0.03}, {0.1, 0.2, -0.3}}};
}

TEST(State, PlusAndMinusAreInverse) {
  const State x = some_state();
  for (const double scale : {1e-9, 1e-3, 1.0}) {
    StateTangent d;
    for (int i = 0; i < kStateDof; ++i) d[i] = scale * std::sin(1.0 + 2.3 * i);
    const State y = plus(x, d);
    // Rounding of numbers of order 1.
    EXPECT_LT((minus(y, x) - d).cwiseAbs().maxCoeff(), 2e-15) << scale;
    EXPECT_LT(minus(plus(x, minus(y, x)), y).cwiseAbs().maxCoeff(), 2e-15) << scale;
  }
  EXPECT_EQ(minus(x, x), StateTangent::Zero());
}

TEST(State, TangentOrderAndSides) {
  const State x = some_state();
  StateTangent d;
  for (int i = 0; i < kStateDof; ++i) d[i] = 0.01 * (i + 1);
  const State y = plus(x, d);
  constexpr double kRounding = 1e-15;
  EXPECT_LT((y.T_W_B.p - x.T_W_B.p - Eigen::Vector3d(0.01, 0.02, 0.03)).norm(), kRounding);
  const Eigen::Quaterniond right = x.T_W_B.q * exp_quaternion(Eigen::Vector3d(0.04, 0.05, 0.06));
  EXPECT_LT(rotation_angle(right.conjugate() * y.T_W_B.q), kRounding);
  EXPECT_LT((y.v_W - x.v_W - Eigen::Vector3d(0.07, 0.08, 0.09)).norm(), kRounding);
  EXPECT_LT((y.bias.gyro_rad_s - x.bias.gyro_rad_s - Eigen::Vector3d(0.10, 0.11, 0.12)).norm(), kRounding);
  EXPECT_LT((y.bias.accel_m_s2 - x.bias.accel_m_s2 - Eigen::Vector3d(0.13, 0.14, 0.15)).norm(), kRounding);

  const StateTangent sigmas = StateSigmas{.position_m = 1.0,
                                          .orientation_rad = 2.0,
                                          .velocity_m_s = 3.0,
                                          .gyro_bias_rad_s = 4.0,
                                          .accel_bias_m_s2 = 5.0}
                                  .per_axis();
  for (int i = 0; i < kStateDof; ++i) {
    const int block = i / 3;
    EXPECT_EQ(sigmas[i], 1.0 + block) << i;
  }
}

}  // namespace
}  // namespace plumbline::core
