// Line factors: the laws of tests/factor_laws.h, hand-worked vectors, degenerate lines, and what the noise of the
// pixels does to the times.
#include "estimator/factors/line_factors.h"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "core/random.h"
#include "factor_laws.h"
#include "line_scene.h"
#include "line_subjects.h"

namespace plumbline::estimator {
namespace {

using core::Pose;
using core::State;
using testing::Block;
using testing::block;
using testing::camera_line_scene;
using testing::FactorScene;
using testing::kLineManifold;
using testing::kLineRandom;
using testing::LineView;
using testing::noisy_segment;
using testing::pose_block;
using testing::propagated_line_scene;
using testing::state_block;
using testing::velocity_line_scene;

State at_rest(const Pose& T_W_B) {
  State s;
  s.T_W_B = T_W_B;
  return s;
}

// ---- hand-worked vectors: the normalised plane as picture, T_W_B = ((.1, .2, .3), I), T_B_C = I

struct HandWorked {
  CameraModel model{
      .camera = {.width_px = 640, .height_px = 480, .fx_px = 1.0, .fy_px = 1.0, .cx_px = 0.0, .cy_px = 0.0}};
  SegmentPixels pixels = {Eigen::Vector2d(-0.24, 0.13), Eigen::Vector2d(0.21, 0.19)};
  SegmentVelocities velocities = {Eigen::Vector2d(0.4, -0.2), Eigen::Vector2d(0.4, -0.2)};
  State state = at_rest({Eigen::Quaterniond::Identity(), {0.1, 0.2, 0.3}});
  // Given in the camera.
  LineBlock line =
      testing::line_block(Eigen::Vector3d(-1.0, 0.5, 4.0) + Eigen::Vector3d(0.1, 0.2, 0.3),
                          Eigen::Vector3d(1.0, 1.0, 5.0) + Eigen::Vector3d(0.1, 0.2, 0.3), Eigen::Vector3d::Zero())
          .value();
  Eigen::Matrix<double, 2, 3> by_p;
  Eigen::Matrix<double, 2, 3> by_theta;
  Eigen::Matrix<double, 2, 4> by_line;
  Eigen::Vector2d r{0.003287979746107, -0.011507929111375};

  HandWorked() {
    by_p << -0.040907207472, 0.245443244831, -0.040907207472, -0.032731690265, 0.196390141592, -0.032731690265;
    by_theta << -1.007232606277, -0.203765879941, -0.21536267337, -1.019495882087, -0.130186225082, 0.238378531593;
    by_line << 0.009860868291, 1.0765581519, 0.324386544557, 0.147439193804, 0.02199072786, 0.861402431462,
        0.723414613437, 0.117972707569;
  }
};
constexpr double kPrinted = 5e-12;  // of figures printed with twelve decimals

TEST(LineFactors, HandWorkedCameraChain) {
  const HandWorked h;
  const CameraLineFactor factor(h.model, Eigen::Vector3d::Zero(), h.pixels);
  const std::vector<Block> blocks = {pose_block(h.state.T_W_B), block(h.line, &kLineManifold)};
  EXPECT_LT((testing::residual(factor, blocks) - h.r).norm(), 1e-14);
  const Eigen::MatrixXd J = testing::tangent_jacobian(factor, blocks, 0);
  EXPECT_LT((J.leftCols<3>() - h.by_p).cwiseAbs().maxCoeff(), kPrinted);
  EXPECT_LT((J.rightCols<3>() - h.by_theta).cwiseAbs().maxCoeff(), kPrinted);
  EXPECT_LT((testing::tangent_jacobian(factor, blocks, 1) - h.by_line).cwiseAbs().maxCoeff(), kPrinted);
}

TEST(LineFactors, HandWorkedBodyChainAndTimeOffset) {
  const HandWorked h;
  const VelocityLineFactor factor(h.model, Eigen::Vector3d::Zero(), h.pixels, h.velocities, 0.0);
  const std::vector<Block> blocks = {state_block(h.state), pose_block(Pose{}), testing::scalar_block(0.0),
                                     testing::scalar_block(0.0), block(h.line, &kLineManifold)};
  EXPECT_LT((testing::residual(factor, blocks) - h.r).norm(), 1e-14);
  const Eigen::MatrixXd J = testing::tangent_jacobian(factor, blocks, 0);
  EXPECT_LT((J.leftCols<3>() - h.by_p).cwiseAbs().maxCoeff(), kPrinted);
  EXPECT_LT((J.middleCols<3>(3) - h.by_theta).cwiseAbs().maxCoeff(), kPrinted);
  EXPECT_EQ(J.rightCols<9>().cwiseAbs().maxCoeff(), 0.0);
  EXPECT_LT((testing::tangent_jacobian(factor, blocks, 4) - h.by_line).cwiseAbs().maxCoeff(), kPrinted);
  const Eigen::MatrixXd by_td = testing::tangent_jacobian(factor, blocks, 2);
  EXPECT_NEAR(by_td(0, 0), 0.263038379688572, 1e-14);
  EXPECT_NEAR(by_td(1, 0), 0.263038379688572, 1e-14);
}

// The velocity along the line is not seen (the aperture problem).
TEST(LineFactors, OnlyTheVelocityAcrossTheLineCounts) {
  const HandWorked h;
  const Eigen::Vector3d C(-1.0, 0.5, 4.0);
  const Eigen::Vector3d D(1.0, 1.0, 5.0);
  const Eigen::Vector2d along = (D.head<2>() / D.z() - C.head<2>() / C.z()).normalized();
  const VelocityLineFactor factor(h.model, Eigen::Vector3d::Zero(), h.pixels, {3.0 * along, -7.0 * along}, 0.0);
  const std::vector<Block> blocks = {state_block(h.state), pose_block(Pose{}), testing::scalar_block(0.3),
                                     testing::scalar_block(0.0), block(h.line, &kLineManifold)};
  EXPECT_LT((testing::residual(factor, blocks) - h.r).norm(), 1e-13);
  EXPECT_LT(testing::tangent_jacobian(factor, blocks, 2).norm(), 1e-13);
}

// The text-book form with the line l = Kl n_c in pixels, l3 and all, for a camera whose axes differ.
TEST(LineResidual, IsTheDistanceFromTheLineInPixels) {
  const core::PinholeCamera camera{
      .width_px = 640, .height_px = 480, .fx_px = 460.0, .fy_px = 410.0, .cx_px = 300.0, .cy_px = 250.0};
  const Eigen::Vector3d C(-1.0, 0.5, 4.0);
  const Eigen::Vector3d D(1.0, 1.0, 5.0);
  const Eigen::Vector2d s(200.0, 300.0);
  Eigen::Matrix3d Kl;
  Kl << 410.0, 0.0, 0.0, 0.0, 460.0, 0.0, -410.0 * 300.0, -460.0 * 250.0, 460.0 * 410.0;
  const Eigen::Vector3d l = Kl * C.cross(D);
  const LineEndPoint end(camera, s);
  for (const double scale : {1.0, 0.01, 300.0}) {  // of the line's coordinates: the distance does not change
    LineDistance distance;
    ASSERT_TRUE(line_distance(scale * C.cross(D), end.b, end.D, distance));
    EXPECT_NEAR(distance.r_px, s.homogeneous().dot(l) / l.head<2>().norm(), 1e-11);
    // By hand: the distance from the line through the two images.
    const Eigen::Vector2d c(460.0 * -0.25 + 300.0, 410.0 * 0.125 + 250.0);
    const Eigen::Vector2d d(460.0 * 0.2 + 300.0, 410.0 * 0.2 + 250.0);
    const Eigen::Vector2d along = (d - c).normalized();
    EXPECT_NEAR(std::abs(distance.r_px), std::abs(along.x() * (s - c).y() - along.y() * (s - c).x()), 1e-11);
    // The derivative belongs to the scale of n_c.
    EXPECT_NEAR(distance.dr_dn.dot(scale * C.cross(D)), 0.0, 1e-11);
  }
}

// ---- relations between the factors

TEST(LineFactors, TheCameraChainIsTheBodyChainWithoutExtrinsics) {
  const LineView v = testing::still_line(3);
  const CameraModel model = testing::line_model(v);
  const Pose T_W_C = v.state.T_W_B * v.rig.T_B_C;
  const CameraLineFactor direct(model, v.origin_W, noisy_segment(v.pixels, {.noise = 1.0}));
  const VelocityLineFactor chain(model, v.origin_W, noisy_segment(v.pixels, {.noise = 1.0}), {}, 0.0);
  const std::vector<Block> camera = {pose_block(T_W_C), block(v.line, &kLineManifold)};
  const std::vector<Block> body = {state_block(at_rest(T_W_C)), pose_block(Pose{}), testing::scalar_block(0.0),
                                   testing::scalar_block(0.0), block(v.line, &kLineManifold)};
  EXPECT_LT((testing::residual(direct, camera) - testing::residual(chain, body)).norm(), 1e-10);
  const Eigen::MatrixXd J_direct = testing::tangent_jacobian(direct, camera, 0);
  const Eigen::MatrixXd J_body = testing::tangent_jacobian(chain, body, 0).leftCols<6>();
  EXPECT_LT((J_direct - J_body).norm() / J_direct.norm(), 1e-12);
}

// At r = 0 and tau = 0 both timing models are one: the velocity of the end point is the motion of the camera.
TEST(LineFactors, BothTimingModelsAgreeOnTheLineAtTheState) {
  const LineView v = testing::handheld_line(2, 0.0, 0.0);
  const FactorScene propagated = propagated_line_scene(v, {});
  const FactorScene velocity = velocity_line_scene(v, {});
  EXPECT_LT(testing::residual(*velocity.factor, velocity.blocks).norm(), 1e-3);
  EXPECT_LT(testing::residual(*propagated.factor, propagated.blocks).norm(), 1e-3);
  for (const std::size_t k : {2U, 3U}) {
    const Eigen::MatrixXd a = testing::tangent_jacobian(*propagated.factor, propagated.blocks, k);
    const Eigen::MatrixXd b = testing::tangent_jacobian(*velocity.factor, velocity.blocks, k);
    EXPECT_LT((a - b).norm() / b.norm(), 1e-5) << k;
  }
}

// ---- noise and time

// Of the first end at the truth: residual [px] and its derivatives by td and readout [px/s].
struct FirstEnd {
  double r_px;
  double by_td;
  double by_readout;
};
FirstEnd first_end(LineView v, const Eigen::Vector2d& offset_px) {
  v.pixels[0] += offset_px;
  const FactorScene s = propagated_line_scene(v, {});
  return {testing::kLineSigmaPx * testing::residual(*s.factor, s.blocks)[0],
          testing::kLineSigmaPx * testing::tangent_jacobian(*s.factor, s.blocks, 2)(0, 0),
          testing::kLineSigmaPx * testing::tangent_jacobian(*s.factor, s.blocks, 3)(0, 0)};
}

// The unit normal of the curve at the first end.
Eigen::Vector2d across(const LineView& v) {
  constexpr double kStepPx = 0.1;
  const auto slope = [&](const Eigen::Vector2d& axis) {
    return (first_end(v, kStepPx * axis).r_px - first_end(v, -kStepPx * axis).r_px) / (2.0 * kStepPx);
  };
  return {slope(Eigen::Vector2d::UnitX()), slope(Eigen::Vector2d::UnitY())};
}

// Moved across its curve an end keeps its time: the residual grows by as much, the derivatives stay.
TEST(PropagatedLineFactor, NoiseAcrossTheCurveIsNotATime) {
  for (std::uint64_t i = 0; i < 8; ++i) {
    const LineView v = testing::handheld_line(i);
    const Eigen::Vector2d normal = across(v);
    EXPECT_NEAR(normal.norm(), 1.0, 1e-6);  // a distance, so it has the pixel's variance
    const FirstEnd before = first_end(v, {0.0, 0.0});
    const FirstEnd after = first_end(v, 3.0 * normal);
    EXPECT_NEAR(after.r_px, before.r_px + 3.0, 1e-4);
    EXPECT_NEAR(after.by_td, before.by_td, 1e-3 * std::abs(before.by_td));
    EXPECT_NEAR(after.by_readout, before.by_readout, 1e-3 * std::abs(before.by_td));
  }
}

// The row whose time is used, dr/dreadout over dr/dtd, is uncorrelated with the residual, so that readout is not
// biased: E[r row] = 0 at the truth. With the time of the observed row it would be n_v sigma^2, n the normal of the
// curve.
TEST(PropagatedLineFactor, NoiseOfTheTimeIsIndependentOfTheResidual) {
  constexpr std::uint64_t kDraws = 60;
  constexpr std::uint64_t kScenes = 8;
  constexpr double kVariance = testing::kLineSigmaPx * testing::kLineSigmaPx;
  double sum = 0.0;
  double sum2 = 0.0;
  double observed_row = 0.0;
  for (std::uint64_t i = 0; i < kScenes; ++i) {
    const LineView v = testing::handheld_line(i);
    const double n_v = across(v).y();
    const auto row = [&](const FirstEnd& end) { return v.camera.height_px * end.by_readout / end.by_td; };
    const double true_row = row(first_end(v, {0.0, 0.0}));
    observed_row += std::abs(n_v) / kScenes;
    for (std::uint64_t k = 0; k < kDraws; ++k) {
      const FirstEnd end = first_end(v, testing::kLineSigmaPx * kLineRandom.normal2(2000 + k, i));
      const double z = std::copysign(1.0, n_v) * end.r_px * (row(end) - true_row) / kVariance;
      sum += z;
      sum2 += z * z;
    }
  }
  constexpr double kN = static_cast<double>(kDraws * kScenes);
  const double standard_error = std::sqrt(sum2) / kN;
  EXPECT_LT(std::abs(sum / kN), 3.9 * standard_error);  // one false alarm in 10^4
  EXPECT_GT(observed_row, 6.0 * standard_error);        // and the test can tell
}

// ---- degenerate lines

TEST(LineFactors, DegenerateIsFalse) {
  std::vector<FactorScene> scenes;
  // n = 0: through its origin; d = 0: at infinity.
  for (const Eigen::Vector2d& W : {Eigen::Vector2d(0.0, 1.0), Eigen::Vector2d(1.0, 0.0), Eigen::Vector2d(0.0, 0.0)}) {
    LineView v = testing::handheld_line(1);
    v.line.tail<2>() = W;
    scenes.push_back(camera_line_scene(v, {}));
    scenes.push_back(velocity_line_scene(v, {}));
    scenes.push_back(propagated_line_scene(v, {}));
  }
  // In the plane z = 0 of the camera, so that its image is at infinity (l1 = l2 = 0); and through the camera's centre.
  // Both about an origin that they miss, with the camera at the world's origin.
  for (const double y : {1.0, 0.0}) {
    LineView v = testing::still_line(1);
    v.state.T_W_B = {};
    v.rig.T_B_C = {};
    v.origin_W = {0.0, 0.0, 1.0};
    v.line = testing::line_block({-1.0, y, 0.0}, {1.0, y, 0.0}, v.origin_W).value();
    scenes.push_back(camera_line_scene(v, {}));
    scenes.push_back(velocity_line_scene(v, {}));
    scenes.push_back(propagated_line_scene(v, {}));
  }
  for (std::size_t i = 0; i < scenes.size(); ++i) {
    Eigen::Vector2d r;
    EXPECT_FALSE(scenes[i].factor->Evaluate(testing::pointers(scenes[i].blocks).data(), r.data(), nullptr)) << i;
  }
}

// The laws have tables at the state's own biases. Elsewhere the first-order correction takes part.
TEST(PropagatedLineFactor, JacobiansHoldAwayFromTheBiasesOfTheTable) {
  for (std::uint64_t i = 0; i < 8; ++i) {
    FactorScene s = propagated_line_scene(testing::handheld_line(i), {.scene = i, .noise = 1.0});
    testing::displace(s.blocks[0], 0.02, kLineRandom, 3000 + i, 0);
    testing::expect_jacobian(*s.factor, s.blocks, 0, s.blocks[0].ridders_step, 1e-6);
  }
}

TEST(LineFactors, LeavingTheLocalMotionIsFalse) {
  FactorScene s = propagated_line_scene(testing::handheld_line(1), {});
  s.blocks[2].values[0] = 0.5;
  Eigen::Vector2d r;
  EXPECT_FALSE(s.factor->Evaluate(testing::pointers(s.blocks).data(), r.data(), nullptr));
}

}  // namespace
}  // namespace plumbline::estimator

namespace plumbline::testing {
INSTANTIATE_TEST_SUITE_P(Lines, FactorLaws, ::testing::ValuesIn(line_subjects()), subject_name);
INSTANTIATE_TEST_SUITE_P(Lines, WorldFrameLaws, ::testing::ValuesIn(in_world(line_subjects())), subject_name);
}  // namespace plumbline::testing
