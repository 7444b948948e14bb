// BAL camera and factors: the laws of tests/factor_laws.h, hand-worked vectors, and the manifold of the left form.
#include "estimator/factors/bal_factors.h"

#include <cmath>

#include <ceres/manifold_test_utils.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bal_subjects.h"
#include "core/random.h"
#include "factor_laws.h"

namespace plumbline::estimator {
namespace {

using core::BalCamera;
using core::ViewAxis;
using testing::bal_scene;
using testing::BalForm;
using testing::FactorScene;
using testing::kBalRandom;

// A camera worked out by hand (docs/derivations.md).
const BalCamera kCamera{.w = {0.3, -0.2, 0.1}, .t = {0.1, -0.2, 5.0}, .intrinsics = {500.0, -0.1, 0.05}};
const Eigen::Vector3d kPoint(1.0, 0.5, 0.25);
constexpr double kPrinted = 5e-12;  // of figures printed with twelve decimals

TEST(BalCamera, HandWorkedVector) {
  const Eigen::Vector3d P_C = core::exp_so3(kCamera.w) * kPoint + kCamera.t;
  EXPECT_LT((P_C - Eigen::Vector3d(0.966488002321, 0.267588447007, 5.585712887053)).norm(), kPrinted);
  const Eigen::Vector2d uv(86.23991848679480, 23.876970849622772);
  EXPECT_LT((core::project_bal(kCamera.intrinsics, ViewAxis::kPlusZ, P_C).value() - uv).norm(), 1e-13);
  EXPECT_LT((core::project_bal(kCamera.intrinsics, ViewAxis::kMinusZ, P_C).value() + uv).norm(), 1e-13);
}

TEST(BalFactors, HandWorkedJacobians) {
  Eigen::Matrix<double, 2, 3> by_t;
  by_t << 88.711487293389, -0.143614543317, -15.342743223181, -0.143614543317, 89.19043866784, -4.247896323664;
  Eigen::Matrix<double, 2, 3> by_w_left;
  by_w_left << -7.08997258777, 65.253764262928, -41.604906853969, -54.226256574673, 3.596634310768, 77.349597528674;
  Eigen::Matrix<double, 2, 3> by_w;
  by_w << -8.773236839549, 58.5640253854, -49.934591853689, -45.60630736055, 17.967090839166, 80.230662943103;
  for (const auto& [axis, sign] : {std::pair{ViewAxis::kPlusZ, 1.0}, std::pair{ViewAxis::kMinusZ, -1.0}}) {
    const FactorScene additive = bal_scene(BalForm::kAdditive, kCamera, kPoint, {0.0, 0.0}, axis);
    const Eigen::MatrixXd J = testing::tangent_jacobian(*additive.factor, additive.blocks, 0);
    EXPECT_LT((sign * J.leftCols<3>() - by_w).cwiseAbs().maxCoeff(), kPrinted);
    EXPECT_LT((sign * J.middleCols<3>(3) - by_t).cwiseAbs().maxCoeff(), kPrinted);
    const FactorScene left = bal_scene(BalForm::kLeft, kCamera, kPoint, {0.0, 0.0}, axis);
    const Eigen::MatrixXd J_left = testing::tangent_jacobian(*left.factor, left.blocks, 0);
    EXPECT_LT((sign * J_left.leftCols<3>() - by_w_left).cwiseAbs().maxCoeff(), kPrinted);
    EXPECT_LT((sign * J_left.middleCols<3>(3) - by_t).cwiseAbs().maxCoeff(), kPrinted);
  }
}

// A camera of a file looks down its -z axis, and its picture is not mirrored: p = -P/P.z.
TEST(BalFactors, FilesLookDownMinusZ) {
  const BalCamera camera{.intrinsics = {100.0, 0.0, 0.0}};
  const Eigen::Vector3d X(0.1, 0.2, -1.0);
  const FactorScene scene = bal_scene(BalForm::kAdditive, camera, X, {10.0, 20.0}, ViewAxis::kMinusZ);
  EXPECT_LT(testing::residual(*scene.factor, scene.blocks).norm(), 1e-13);
  EXPECT_TRUE(core::in_front(camera, ViewAxis::kMinusZ, X));
  EXPECT_FALSE(core::in_front(camera, ViewAxis::kPlusZ, X));
}

// Both forms of Rodrigues' formula: a mixture of them is no rotation, which shows at large angles first.
TEST(BalFactors, RotatesByTheMatrixOfItsVector) {
  for (std::uint64_t i = 0; i < 20; ++i) {
    const Eigen::Vector3d w = 3.0 * kBalRandom.uniform(i, 20) * kBalRandom.normal3(i, 21).normalized();
    const Eigen::Vector3d X = kBalRandom.normal3(i, 22);
    const BalCamera camera{.w = w, .t = {0.0, 0.0, -9.0}, .intrinsics = {100.0, 0.0, 0.0}};
    const Eigen::Vector3d P = Eigen::AngleAxisd(w.norm(), w.normalized()) * X + camera.t;
    const FactorScene scene = bal_scene(BalForm::kAdditive, camera, X, -100.0 * P.head<2>() / P.z(), ViewAxis::kMinusZ);
    EXPECT_LT(testing::residual(*scene.factor, scene.blocks).norm(), 1e-12);
  }
}

TEST(BalFactors, InThePlaneOfTheCameraIsFalse) {
  for (const BalForm form : {BalForm::kAdditive, BalForm::kLeft}) {
    const FactorScene scene =
        bal_scene(form, {.intrinsics = {100.0, 0.0, 0.0}}, {1.0, 2.0, 0.0}, {1.0, 2.0}, ViewAxis::kMinusZ);
    Eigen::Vector2d r;
    EXPECT_FALSE(scene.factor->Evaluate(testing::pointers(scene.blocks).data(), r.data(), nullptr));
  }
}

TEST(BalCamera, BlocksRoundTrip) {
  const BalCamera same = unpack_bal_camera(pack(kCamera));
  const BalCamera left = unpack_bal_camera(pack_left(kCamera));
  EXPECT_EQ(same.w, kCamera.w);
  EXPECT_LT((left.w - kCamera.w).norm(), 1e-15);
  for (const BalCamera& c : {same, left}) {
    EXPECT_EQ(c.t, kCamera.t);
    EXPECT_EQ(c.intrinsics.f_px, 500.0);
    EXPECT_EQ(c.intrinsics.k1, -0.1);
    EXPECT_EQ(c.intrinsics.k2, 0.05);
  }
  EXPECT_LT((core::exp_so3(kCamera.w) * kCamera.centre() + kCamera.t).norm(), 1e-15);
}

TEST(LeftSo3Manifold, ObeysTheLawsOfCeres) {
  using namespace ceres;  // the macro's own names
  const LeftSo3Manifold manifold;
  for (std::uint64_t i = 0; i < 10; ++i) {
    for (const double scale : {0.0, 1e-6, 0.1, 2.0}) {
      const Vector x = core::exp_quaternion(kBalRandom.normal3(i, 30)).coeffs();
      const Vector delta = scale * kBalRandom.normal3(i, 31).normalized();
      Vector y(4);
      manifold.Plus(x.data(), Eigen::Vector3d(1.0, -0.5, 0.3).data(), y.data());
      EXPECT_THAT_MANIFOLD_INVARIANTS_HOLD(manifold, x, delta, y, 1e-9);
    }
  }
}

TEST(LeftSo3Manifold, PerturbsOnTheLeftByTheWholeAngle) {
  const LeftSo3Manifold manifold;
  const Eigen::Quaterniond q = core::exp_quaternion(Eigen::Vector3d(0.3, -0.2, 0.1));
  const Eigen::Vector3d delta(0.0, 0.0, 0.4);
  Eigen::Quaterniond moved;
  manifold.Plus(q.coeffs().data(), delta.data(), moved.coeffs().data());
  const Eigen::Matrix3d expected = Eigen::AngleAxisd(0.4, Eigen::Vector3d::UnitZ()) * q.toRotationMatrix();
  EXPECT_LT((moved.toRotationMatrix() - expected).norm(), 1e-15);
}

}  // namespace
}  // namespace plumbline::estimator

namespace plumbline::testing {
INSTANTIATE_TEST_SUITE_P(Bal, FactorLaws, ::testing::ValuesIn(bal_subjects()), subject_name);
INSTANTIATE_TEST_SUITE_P(Bal, WorldFrameLaws, ::testing::ValuesIn(in_world(bal_subjects())), subject_name);
}  // namespace plumbline::testing
