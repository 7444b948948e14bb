// Pluecker geometry, the orthonormal form and its manifold.
#include "estimator/factors/orthonormal_line.h"

#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include <ceres/manifold_test_utils.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/lie.h"
#include "core/random.h"

namespace plumbline::estimator {
namespace {

const core::RandomStream kRandom({21, 0}, "orthonormal_line_test");

LineBlock random_line(std::uint64_t i) {
  return orthonormal_line(line_through(kRandom.normal3(i, 0), kRandom.normal3(i, 1))).value();
}

LineBlock with_weights(LineBlock x, double angle) {
  x.tail<2>() << std::cos(angle), std::sin(angle);
  return x;
}

// The point lies on the line where P x d = n.
double miss(const PluckerLine& L, const Eigen::Vector3d& P) { return (P.cross(L.d) - L.n).norm() / L.d.norm(); }

TEST(Plucker, NormalIsPointTimesDirection) {
  const PluckerLine L = line_through({1.0, 0.0, 2.0}, {1.0, 3.0, 2.0});
  EXPECT_EQ(L.d, Eigen::Vector3d(0.0, 3.0, 0.0));
  EXPECT_EQ(L.n, Eigen::Vector3d(-6.0, 0.0, 3.0));  // C x D, not d x P
  EXPECT_LT((L.nearest_point() - Eigen::Vector3d(1.0, 0.0, 2.0)).norm(), 1e-15);
}

TEST(Plucker, AnotherFrameSeesTheSamePoints) {
  for (std::uint64_t i = 0; i < 10; ++i) {
    const Eigen::Vector3d C = kRandom.normal3(i, 2);
    const Eigen::Vector3d D = kRandom.normal3(i, 3);
    const core::Pose T{core::exp_quaternion(kRandom.normal3(i, 4)), kRandom.normal3(i, 5)};
    const PluckerLine moved = in_frame(line_through(C, D), T.q.toRotationMatrix(), T.p);
    const PluckerLine expected = line_through(T.inverse() * C, T.inverse() * D);
    EXPECT_LT((moved.n - expected.n).norm() + (moved.d - expected.d).norm(), 1e-13);
  }
}

TEST(OrthonormalLine, KeepsTheLineAndForgetsTheScale) {
  for (std::uint64_t i = 0; i < 10; ++i) {
    const Eigen::Vector3d C = kRandom.normal3(i, 0);
    const Eigen::Vector3d D = kRandom.normal3(i, 1);
    const LineBlock x = orthonormal_line(line_through(C, D)).value();
    const PluckerLine L = OrthonormalLine(x.data()).plucker();
    EXPECT_NEAR(L.n.squaredNorm() + L.d.squaredNorm(), 1.0, 1e-14);
    EXPECT_LT(miss(L, C), 1e-13);
    EXPECT_LT(miss(L, D), 1e-13);
    EXPECT_GT(L.d.dot(D - C), 0.0);
    // Other points of the same line, in the same order.
    const LineBlock same = orthonormal_line(line_through(C - 3.0 * (D - C), C + 7.0 * (D - C))).value();
    EXPECT_LT((same - x).norm(), 1e-12);
  }
}

TEST(OrthonormalLine, DegenerateLinesHaveNoForm) {
  const Eigen::Vector3d e(1.0, 2.0, 3.0);
  EXPECT_FALSE(orthonormal_line({Eigen::Vector3d::Zero(), e}));  // through the origin
  EXPECT_FALSE(orthonormal_line({e, Eigen::Vector3d::Zero()}));  // at infinity
  EXPECT_FALSE(orthonormal_line({Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()}));
  EXPECT_FALSE(orthonormal_line(line_through(e, 2.0 * e)));
  EXPECT_FALSE(orthonormal_line({e, Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN())}));
  EXPECT_FALSE(orthonormal_line({Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity()), e}));
}

// dL/d(psi, phi) by differences through Plus and plucker(), all four columns.
TEST(OrthonormalLine, TangentOfThePluckerCoordinates) {
  const OrthonormalLineManifold manifold;
  for (std::uint64_t i = 0; i < 10; ++i) {
    const LineBlock x = random_line(i);
    const OrthonormalLine line(x.data());
    constexpr double kStep = 1e-5;  // leaves its square and rounding over it: 1e-10
    Eigen::Matrix<double, 6, 4> numeric;
    for (int k = 0; k < 4; ++k) {
      const auto at = [&](double h) {
        Eigen::Vector4d delta = Eigen::Vector4d::Zero();
        delta[k] = h;
        LineBlock moved;
        manifold.Plus(x.data(), delta.data(), moved.data());
        const PluckerLine L = OrthonormalLine(moved.data()).plucker();
        Eigen::Matrix<double, 6, 1> v;
        v << L.n, L.d;
        return v;
      };
      numeric.col(k) = (at(kStep) - at(-kStep)) / (2.0 * kStep);
    }
    Eigen::Matrix<double, 6, 4> analytic;
    for (int r = 0; r < 6; ++r) {
      const Eigen::Matrix<double, 6, 1> e = Eigen::Matrix<double, 6, 1>::Unit(r);
      analytic.row(r) = line.to_tangent(e.head<3>(), e.tail<3>());
    }
    EXPECT_LT((analytic - numeric).cwiseAbs().maxCoeff(), 1e-9);
    // Where the signs are in print the other way: the first column holds + w2 u3, the second - w1 u3.
    EXPECT_LT((analytic.col(0).tail<3>() - line.w2 * line.U.col(2)).norm(), 1e-15);
    EXPECT_LT((analytic.col(1).head<3>() + line.w1 * line.U.col(2)).norm(), 1e-15);
  }
}

TEST(OrthonormalLine, RowsForCeresGiveTheTangentAgain) {
  const OrthonormalLineManifold manifold;
  const LineBlock x = random_line(3);
  const Eigen::RowVector4d J(0.3, -1.2, 0.7, 2.5);
  Eigen::Matrix<double, 1, kLineSize> ambient;
  OrthonormalLine(x.data()).write_row(J, ambient.data());
  Eigen::Matrix<double, kLineSize, kLineDof, Eigen::RowMajor> plus;
  manifold.PlusJacobian(x.data(), plus.data());
  EXPECT_LT((ambient * plus - J).norm(), 1e-14);
}

// Ceres' own laws, at lines of all kinds: W at and beyond 90 degrees too, where an arc sine would fold.
TEST(OrthonormalLineManifold, ObeysTheLawsOfCeres) {
  using namespace ceres;  // the macro's own names
  const OrthonormalLineManifold manifold;
  constexpr double kTolerance = 1e-9;
  const std::vector<double> angles = {0.0, 0.3, 1.5, 0.5 * std::numbers::pi, 1.6, 2.5, -3.0};
  std::uint64_t i = 0;
  for (const double angle : angles) {
    for (const double scale : {0.0, 1e-6, 0.1, 1.0}) {
      const Vector x = with_weights(random_line(++i), angle);
      Vector y(kLineSize);
      Vector delta(kLineDof);
      Vector other(kLineDof);
      delta << scale * kRandom.normal3(i, 6).normalized(), scale;
      other << kRandom.normal3(i, 7).normalized(), -0.8;
      manifold.Plus(x.data(), other.data(), y.data());
      EXPECT_THAT_MANIFOLD_INVARIANTS_HOLD(manifold, x, delta, y, kTolerance);
    }
  }
}

// Moving phi through 90 degrees and back is one smooth way.
TEST(OrthonormalLineManifold, PhiGoesThroughNinetyDegrees) {
  const OrthonormalLineManifold manifold;
  const LineBlock start = with_weights(random_line(40), 1.2);
  LineBlock x = start;
  const Eigen::Vector4d step(0.0, 0.0, 0.0, 0.1);
  for (int k = 1; k <= 20; ++k) {
    LineBlock next;
    manifold.Plus(x.data(), step.data(), next.data());
    x = next;
    EXPECT_NEAR(x[4], std::cos(1.2 + 0.1 * k), 1e-14);
    EXPECT_NEAR(x[5], std::sin(1.2 + 0.1 * k), 1e-14);
    Eigen::Vector4d back;
    manifold.Minus(x.data(), start.data(), back.data());
    EXPECT_LT((back - k * step).norm(), 1e-13);
  }
}

}  // namespace
}  // namespace plumbline::estimator
