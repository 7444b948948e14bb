// Laws that every factor obeys, as one suite. A test file describes its factors as subjects and instantiates
//   INSTANTIATE_TEST_SUITE_P(Points, FactorLaws, ::testing::ValuesIn(subjects()), subject_name);
//   INSTANTIATE_TEST_SUITE_P(Points, WorldFrameLaws, ::testing::ValuesIn(in_world(subjects())), subject_name);
//   VanishesAtTheTruth        r = 0 at the truth of a simulated scene without noise
//   JacobiansEqualAutomatic   analytic Jacobians equal those of the reference, by automatic differentiation
//   JacobiansMatchRidders     and those of differences on the manifold, which know the residual only
//   EveryNullJacobianPath     what is asked for does not depend on what else is
//   HoldsAtTheLimits          zero angles, far and near: finite, and still equal to the reference
//   WhitensItsNoise           residuals of simulated noise have unit covariance
// and of what refers to the world's frame
//   DoesNotSeeYawNorPlace     yaw and translation of the whole world leave the cost as it is
#pragma once

#include <cmath>
#include <cstdint>
#include <vector>

#include <Eigen/Core>
#include <gtest/gtest.h>

#include "core/lie.h"
#include "factor_checks.h"
#include "factor_subject.h"

namespace plumbline::testing {

class FactorLaws : public ::testing::TestWithParam<FactorSubject> {
 protected:
  static constexpr std::uint64_t kScenes = 8;
};

TEST_P(FactorLaws, VanishesAtTheTruth) {
  for (std::uint64_t i = 0; i < kScenes; ++i) {
    const FactorScene s = GetParam().scene({.scene = i});
    EXPECT_LT(residual(*s.factor, s.blocks).cwiseAbs().maxCoeff(), GetParam().zero_tolerance) << "scene " << i;
  }
}

TEST_P(FactorLaws, JacobiansEqualAutomatic) {
  for (std::uint64_t i = 0; i < kScenes; ++i) {
    SCOPED_TRACE(i);
    const FactorScene s = GetParam().scene({.scene = i, .noise = 1.0, .off_truth = true});
    expect_equal_factors(*s.factor, *s.reference, s.blocks, GetParam().automatic_tolerance);
  }
}

TEST_P(FactorLaws, JacobiansMatchRidders) {
  for (std::uint64_t i = 0; i < kScenes; ++i) {
    SCOPED_TRACE(i);
    const FactorScene s = GetParam().scene({.scene = i, .noise = 1.0, .off_truth = true});
    for (std::size_t k = 0; k < s.blocks.size(); ++k) {
      expect_jacobian(*s.factor, s.blocks, k, s.blocks[k].ridders_step, GetParam().ridders_tolerance,
                      GetParam().zero_floor);
    }
  }
}

TEST_P(FactorLaws, EveryNullJacobianPath) {
  const FactorScene s = GetParam().scene({.scene = 1, .noise = 1.0, .off_truth = true});
  const Eigen::VectorXd r = residual(*s.factor, s.blocks);
  const Evaluation all = evaluate(*s.factor, s.blocks, std::vector<bool>(s.blocks.size(), true));
  EXPECT_EQ(all.residual, r);
  for (std::size_t k = 0; k < s.blocks.size(); ++k) {
    for (const bool alone : {true, false}) {
      std::vector<bool> wanted(s.blocks.size(), !alone);
      wanted[k] = alone;
      const Evaluation some = evaluate(*s.factor, s.blocks, wanted);
      EXPECT_EQ(some.residual, r);
      for (std::size_t j = 0; j < s.blocks.size(); ++j) {
        if (!wanted[j]) continue;
        EXPECT_EQ(some.jacobians[j], all.jacobians[j]) << "block " << j << ", path of block " << k;
      }
    }
  }
}

TEST_P(FactorLaws, HoldsAtTheLimits) {
  const std::vector<FactorScene> limits = GetParam().limits();
  ASSERT_FALSE(limits.empty());
  for (std::size_t i = 0; i < limits.size(); ++i) {
    SCOPED_TRACE(i);
    const FactorScene& s = limits[i];
    const Evaluation all = evaluate(*s.factor, s.blocks, std::vector<bool>(s.blocks.size(), true));
    EXPECT_TRUE(all.residual.allFinite());
    for (const auto& J : all.jacobians) EXPECT_TRUE(J.allFinite());
    expect_equal_factors(*s.factor, *s.reference, s.blocks, GetParam().automatic_tolerance);
  }
}

TEST_P(FactorLaws, WhitensItsNoise) {
  constexpr int kDraws = 1500;
  Eigen::MatrixXd covariance;
  for (int i = 0; i < kDraws; ++i) {
    const FactorScene s = GetParam().scene(
        {.scene = static_cast<std::uint64_t>(i) % kScenes, .noise = 1.0, .draw = 1 + static_cast<std::uint64_t>(i)});
    const Eigen::VectorXd r = residual(*s.factor, s.blocks);
    if (i == 0) covariance.setZero(r.size(), r.size());
    covariance += r * r.transpose() / kDraws;
  }
  // Diagonal entries are chi2(n)/n, standard deviation sqrt(2/n) = 3.7 %, the others have 1/sqrt(n) = 2.6 %: 4.5
  // sigma, since there are up to 120 of them.
  const double off_diagonal = 4.5 / std::sqrt(kDraws) + GetParam().whitening_slack;
  for (Eigen::Index i = 0; i < covariance.rows(); ++i) {
    for (Eigen::Index j = 0; j < i; ++j) EXPECT_NEAR(covariance(i, j), 0.0, off_diagonal) << i << " " << j;
    EXPECT_NEAR(covariance(i, i), 1.0, 4.5 * std::sqrt(2.0 / kDraws) + GetParam().whitening_slack) << i;
  }
}

class WorldFrameLaws : public FactorLaws {};

inline std::vector<FactorSubject> in_world(std::vector<FactorSubject> subjects) {
  std::erase_if(subjects, [](const FactorSubject& subject) { return !subject.in_world; });
  return subjects;
}

TEST_P(WorldFrameLaws, DoesNotSeeYawNorPlace) {
  const core::Pose moved{core::exp_quaternion(Eigen::Vector3d(0.0, 0.0, 1.2)), {3.0, -2.0, 5.0}};
  for (std::uint64_t i = 0; i < kScenes; ++i) {
    const FactorScene here = GetParam().scene({.scene = i, .noise = 1.0, .off_truth = true});
    const FactorScene there = GetParam().scene({.scene = i, .noise = 1.0, .off_truth = true, .T_new_W = moved});
    const double cost = residual(*here.factor, here.blocks).squaredNorm();
    ASSERT_GT(cost, 0.0);
    // Rounding of coordinates of 10 m, seen through derivatives of the whitened residual of up to 1e5.
    EXPECT_NEAR(residual(*there.factor, there.blocks).squaredNorm() / cost, 1.0, 1e-8) << "scene " << i;
  }
}

}  // namespace plumbline::testing
