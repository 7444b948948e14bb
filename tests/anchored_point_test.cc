// Points that are tied to a state: the laws of factors, and the change to another anchor.
#include <gtest/gtest.h>

#include "anchored_subjects.h"
#include "factor_laws.h"

namespace plumbline::testing {
namespace {

INSTANTIATE_TEST_SUITE_P(Anchored, FactorLaws, ::testing::ValuesIn(anchored_subjects()), subject_name);
INSTANTIATE_TEST_SUITE_P(Anchored, WorldFrameLaws, ::testing::ValuesIn(anchored_subjects()), subject_name);

using estimator::change_anchor;

const core::Pose kOld{core::exp_quaternion(Eigen::Vector3d(0.2, -0.4, 1.1)), {3.0, -2.0, 0.7}};
const core::Pose kNew{core::exp_quaternion(Eigen::Vector3d(0.25, -0.3, 1.0)), {3.3, -2.1, 0.6}};

Eigen::Vector3d point_W(const core::Pose& T_W_A, const Eigen::Vector3d& landmark) {
  return T_W_A * (Eigen::Vector3d(landmark.x(), landmark.y(), 1.0) / landmark.z());
}

// p' = Exp(phi) p + rho, R' = Exp(phi) R
core::Pose moved(const core::Pose& T, const Eigen::Matrix<double, 6, 1>& xi) {
  const Eigen::Quaterniond D = core::exp_quaternion(Eigen::Vector3d(xi.tail<3>()));
  return {D * T.q, D * T.p + xi.head<3>()};
}

TEST(AnchorChange, IsTheSamePoint) {
  for (const Eigen::Vector3d& landmark : {Eigen::Vector3d(0.2, -0.3, 0.25), Eigen::Vector3d(0.0, 0.1, 2.0)}) {
    const auto change = change_anchor(landmark, kOld, kNew);
    ASSERT_TRUE(change);
    EXPECT_LT((point_W(kNew, change->landmark) - point_W(kOld, landmark)).norm(), 1e-12);
  }
  // At infinity the bearing turns, and nothing else.
  const auto far = change_anchor({0.2, -0.3, 0.0}, kOld, kNew);
  ASSERT_TRUE(far);
  EXPECT_EQ(far->landmark.z(), 0.0);
  EXPECT_TRUE(far->J_new.allFinite());
  EXPECT_TRUE(far->J_relative.leftCols<3>().isZero(0.0));
}

TEST(AnchorChange, APointBehindTheNewCameraStays) {
  const core::Pose turned{kOld.q * core::exp_quaternion(Eigen::Vector3d(0.0, 3.0, 0.0)), kOld.p};
  EXPECT_FALSE(change_anchor({0.1, 0.1, 0.3}, kOld, turned));
}

TEST(AnchorChange, DerivativesAreThoseOfDifferences) {
  const Eigen::Vector3d landmark(0.2, -0.3, 0.25);
  const auto change = change_anchor(landmark, kOld, kNew);
  ASSERT_TRUE(change);
  // The landmark in the old camera, as a function of that in the new one and of both cameras.
  const auto old_landmark = [](const Eigen::Vector3d& landmark_new, const core::Pose& T_W_old,
                               const core::Pose& T_W_new) {
    return change_anchor(landmark_new, T_W_new, T_W_old)->landmark;
  };
  constexpr double kStep = 1e-6;
  for (int k = 0; k < 3; ++k) {
    const Eigen::Vector3d d = kStep * Eigen::Vector3d::Unit(k);
    const Eigen::Vector3d slope =
        (old_landmark(change->landmark + d, kOld, kNew) - old_landmark(change->landmark - d, kOld, kNew)) /
        (2.0 * kStep);
    EXPECT_LT((slope - change->J_new.col(k)).norm(), 1e-8) << k;
  }
  for (int k = 0; k < 6; ++k) {
    const Eigen::Matrix<double, 6, 1> d = kStep * Eigen::Matrix<double, 6, 1>::Unit(k);
    const Eigen::Vector3d of_new =
        (old_landmark(change->landmark, kOld, moved(kNew, d)) - old_landmark(change->landmark, kOld, moved(kNew, -d))) /
        (2.0 * kStep);
    const Eigen::Vector3d of_old =
        (old_landmark(change->landmark, moved(kOld, d), kNew) - old_landmark(change->landmark, moved(kOld, -d), kNew)) /
        (2.0 * kStep);
    EXPECT_LT((of_new - change->J_relative.col(k)).norm(), 1e-8) << k;
    EXPECT_LT((of_old + change->J_relative.col(k)).norm(), 1e-8) << k;
  }
}

}  // namespace
}  // namespace plumbline::testing
