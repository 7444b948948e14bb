// Point factors: the laws of tests/factor_laws.h, hand-worked vectors, and the mistakes that are easily made in them.
#include <cmath>
#include <memory>

#include <gtest/gtest.h>

#include "factor_laws.h"
#include "imu_subjects.h"
#include "point_subjects.h"

namespace plumbline::testing {
INSTANTIATE_TEST_SUITE_P(Points, FactorLaws, ::testing::ValuesIn(point_subjects()), subject_name);
INSTANTIATE_TEST_SUITE_P(Points, WorldFrameLaws, ::testing::ValuesIn(in_world(point_subjects())), subject_name);
}  // namespace plumbline::testing

namespace plumbline::estimator {
namespace {

using core::DistortionModel;
using testing::Block;
using testing::FactorScene;
using testing::kGravity;
using testing::kSigmaPx;
using testing::pose_block;
using testing::scalar_block;
using testing::scene_views;
using testing::state_block;

using Fixed = FeatureVelocityPoint<LandmarkType::kFixedBearing>;

// MATH's test vector A: q = (1, 1, 4) from a camera at (1, 0, 0), p_i = (.5, .25, 1), lambda = 1/4, p_j = (.3, .2, 1),
// everything else the identity, both bearings moving with (.4, -.2).
struct HandWorked {
  core::PinholeCamera camera{.width_px = 640, .height_px = 480, .fx_px = 1.0, .fy_px = 1.0, .cx_px = 0.0, .cy_px = 0.0};
  MovingBearing observed{camera, 0.0, {0.3, 0.2}, {0.4, -0.2}};
  MovingBearing anchor{camera, 0.0, {0.5, 0.25}, {0.4, -0.2}};
  std::vector<Block> blocks;

  HandWorked() {
    core::State observer;
    observer.T_W_B.p = {1.0, 0.0, 0.0};
    blocks = {state_block(core::State{}), state_block(observer), pose_block(core::Pose{}),
              scalar_block(0.0),          scalar_block(0.0),     scalar_block(0.25)};
  }
};

void expect_vector(const Eigen::VectorXd& actual, double x, double y) {
  // To the printed digits.
  EXPECT_NEAR(actual[0], x, 1e-12);
  EXPECT_NEAR(actual[1], y, 1e-12);
}

TEST(HandWorkedVector, Pinhole) {
  const HandWorked h;
  const Fixed factor(RayChart(ResidualType::kPinhole, h.camera, 1.0, {0.3, 0.2}), h.observed, h.anchor);
  expect_vector(testing::residual(factor, h.blocks), -0.05, 0.05);
  expect_vector(testing::tangent_jacobian(factor, h.blocks, 5), -1.0, 0.0);
  expect_vector(testing::tangent_jacobian(factor, h.blocks, 3), 0.0, 0.0);
}

TEST(HandWorkedVector, UnitSphere) {
  const HandWorked h;
  const Fixed factor(RayChart(h.camera, {0.3, 0.2, 1.0}, Eigen::Matrix2d::Identity()), h.observed, h.anchor);
  expect_vector(testing::residual(factor, h.blocks), 0.012299369397, -0.065372045046);
  const Eigen::VectorXd J_td = testing::tangent_jacobian(factor, h.blocks, 3);
  expect_vector(J_td, 0.000982497227, -0.003716241282);
  // The widespread + S v_j in place of S B N(p_j) v_j.
  EXPECT_GT((J_td - Eigen::Vector2d(0.597336548988, -0.568988876482)).norm(), 0.8);
}

// Of the same vector by the trajectory: a rig at rest has no timing, so both models are one.
TEST(HandWorkedVector, Propagated) {
  const HandWorked h;
  const auto motion = std::make_shared<LocalMotion>(testing::samples_at_rest(21, 0.005), 10, 0.05, core::ImuBias{});
  const PropagatedPoint<LandmarkType::kFixedBearing> factor({h.camera, 1.0, kGravity}, {motion, 0.0}, {motion, 0.0},
                                                            {0.3, 0.2}, {0.5, 0.25});
  expect_vector(testing::residual(factor, h.blocks), -0.05, 0.05);
  expect_vector(testing::tangent_jacobian(factor, h.blocks, 5), -1.0, 0.0);
  expect_vector(testing::tangent_jacobian(factor, h.blocks, 3), 0.0, 0.0);
}

// S makes up for the compression of the picture by the sphere: what is left is curvature, of relative order noise/f.
TEST(RayChart, UnitSphereIsWhitenedLikeThePicture) {
  const core::PinholeCamera camera;
  const Eigen::Vector2d pixel(600.0, 30.0);
  const RayChart sphere(ResidualType::kUnitSphere, camera, kSigmaPx, pixel);
  const RayChart plane(ResidualType::kPinhole, camera, kSigmaPx, pixel);
  for (const Eigen::Vector2d& noise : {Eigen::Vector2d(0.5, 0.0), Eigen::Vector2d(-0.3, 0.8)}) {
    const Eigen::Vector3d q = camera.unproject(pixel + noise);
    Eigen::Vector2d on_sphere;
    Eigen::Vector2d on_plane;
    ASSERT_TRUE(sphere.at(q, on_sphere) && plane.at(q, on_plane));
    EXPECT_LT((on_plane - plane.observed() - noise / kSigmaPx).norm(), 1e-9);
    EXPECT_LT((on_sphere - sphere.observed() - noise / kSigmaPx).norm(), 1e-2);
  }
}

// On the axis S is f/sigma and a rotation.
TEST(RayChart, UnitSphereOnTheAxis) {
  const core::PinholeCamera camera;
  const RayChart sphere(ResidualType::kUnitSphere, camera, kSigmaPx, {camera.cx_px, camera.cy_px});
  Eigen::Vector2d h;
  Matrix23 J;
  ASSERT_TRUE(sphere.at(Eigen::Vector3d::UnitZ(), h, &J));
  EXPECT_NEAR(J.row(0).norm(), camera.fx_px / kSigmaPx, 1e-9);
  EXPECT_NEAR(J.row(1).norm(), camera.fy_px / kSigmaPx, 1e-9);
  EXPECT_NEAR(J.row(0).dot(J.row(1)), 0.0, 1e-9);
}

TEST(RayChart, ARayToTheBackIsNotItsOpposite) {
  const core::PinholeCamera camera;
  for (const ResidualType type : {ResidualType::kPinhole, ResidualType::kUnitSphere}) {
    const RayChart chart(type, camera, kSigmaPx, {400.0, 100.0});
    const Eigen::Vector3d p = camera.unproject({400.0, 100.0});
    Eigen::Vector2d h;
    EXPECT_TRUE(chart.at(p, h));
    EXPECT_FALSE(chart.at(-p, h));
  }
}

// td is added to the camera's time and v is d(x, y)/dt: an observation made late is carried back.
TEST(MovingBearing, IsCarriedBackAlongItsVelocity) {
  const core::PinholeCamera camera;
  const MovingBearing late(camera, 0.0, {319.5, 240.0}, {0.4, -0.2});  // the middle row
  EXPECT_NEAR(late.at(0.01, 0.0).x(), -0.004, 1e-15);
  EXPECT_NEAR(late.at(0.01, 0.03).x(), -0.004, 1e-15);
  const MovingBearing last_row(camera, -0.01, {319.5, 480.0}, {0.4, -0.2});  // td_k = 10 ms
  EXPECT_NEAR(last_row.at(0.01, 0.03).x(), -0.4 * 0.015, 1e-15);
}

// An observation so far off the true pixel; the blocks are at the truth.
FactorScene propagated(std::uint64_t scene, const Eigen::Vector2d& offset_px = Eigen::Vector2d::Zero()) {
  const testing::Variant variant{ResidualType::kPinhole, LandmarkType::kBearingInverseDepth};
  const testing::TwoViews& s = scene_views(testing::Motion::kHandheld, DistortionModel::kNone, scene, false);
  return testing::propagated_scene(s, variant,
                                   testing::blocks_of(s, variant, testing::true_landmark(s, testing::propagated_scene)),
                                   s.observer.pixel + offset_px);
}

bool evaluates(const FactorScene& s) {
  Eigen::Vector2d r;
  return s.factor->Evaluate(testing::pointers(s.blocks).data(), r.data(), nullptr);
}

// The row is the predicted one: noise in the measured row moves the residual by exactly as much and nothing else.
TEST(PropagatedPointFactor, TheMeasuredRowIsNotATime) {
  const FactorScene before = propagated(3);
  const FactorScene after = propagated(3, {0.0, 3.0});
  const Eigen::VectorXd change =
      testing::residual(*after.factor, after.blocks) - testing::residual(*before.factor, before.blocks);
  EXPECT_NEAR(change.x(), 0.0, 1e-9);
  EXPECT_NEAR(change.y(), -3.0 / kSigmaPx, 1e-9);
}

TEST(PropagatedPointFactor, BehindTheObserverIsFalse) {
  FactorScene s = propagated(2);
  EXPECT_TRUE(evaluates(s));
  core::State turned = unpack_state(s.blocks[1].values.data());
  turned.T_W_B.q = turned.T_W_B.q * core::exp_quaternion(Eigen::Vector3d(0, 0, 3.0));
  s.blocks[1] = state_block(turned);
  EXPECT_FALSE(evaluates(s));
}

TEST(PropagatedPointFactor, LeavingTheTableIsFalse) {
  FactorScene s = propagated(2);
  s.blocks[3] = scalar_block(0.5);
  EXPECT_FALSE(evaluates(s));
}

// The laws have tables at the states' own biases. Elsewhere the first-order correction takes part.
TEST(PropagatedPointFactor, JacobiansHoldAwayFromTheBiasesOfTheTables) {
  for (std::uint64_t i = 0; i < 8; ++i) {
    FactorScene s = propagated(i);
    for (const std::size_t k : {0U, 1U}) testing::displace(s.blocks[k], 0.02, testing::kPointRandom, 3000 + i, k);
    for (const std::size_t k : {0U, 1U}) testing::expect_jacobian(*s.factor, s.blocks, k, 1e-3, 1e-6);
  }
}

// The sideways scene obeys both timing models; in a scene that turns, the image velocity is not constant and its model
// is off by half the image acceleration times the square of the shift.
TEST(FeatureVelocity, ItsErrorIsQuadraticInTheShift) {
  const testing::Variant variant{ResidualType::kPinhole, LandmarkType::kBearingInverseDepth};
  const testing::TwoViews& s = scene_views(testing::Motion::kHandheld, DistortionModel::kNone, 3, true, 0.0);
  const auto error_px = [&](double shift_s) {
    // The state lies shift_s before the exposure.
    testing::TwoViews moved = s;
    const double exposure_s = s.observer.t_cam_s + s.rig.td_s;
    moved.observer.state_index = static_cast<std::size_t>(std::llround((exposure_s - shift_s) * testing::kFineHz));
    moved.observer.offset_s = s.observer.t_cam_s - core::to_seconds((*s.samples)[moved.observer.state_index].t_ns);
    sim::TrajectoryConfig c;
    c.handheld.rate_rms_rad_s = 0.75;
    const auto x =
        sim::make_trajectory(c, 1.0, {43, 0})->at(core::to_seconds((*s.samples)[moved.observer.state_index].t_ns));
    moved.observer.state.T_W_B = x.T_W_B;
    const Eigen::Vector3d landmark = testing::true_landmark(moved, testing::feature_velocity_scene);
    const FactorScene scene = testing::feature_velocity_scene(
        moved, variant, testing::blocks_of(moved, variant, landmark), moved.observer.pixel);
    return kSigmaPx * testing::residual(*scene.factor, scene.blocks).norm();
  };
  EXPECT_NEAR(error_px(0.02) / error_px(0.01), 4.0, 1.0);  // the next order adds shift over period
  EXPECT_GT(error_px(0.02), 0.02);
}

}  // namespace
}  // namespace plumbline::estimator
