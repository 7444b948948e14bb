// Line factors: the laws of tests/factor_laws.h, hand-worked vectors, degenerate lines, and what the noise of the
// pixels does to the times.
#include "estimator/factors/line_factors.h"

#include <array>
#include <cmath>
#include <memory>
#include <vector>

#include <ceres/autodiff_cost_function.h>
#include <gtest/gtest.h>

#include "core/random.h"
#include "core/time.h"
#include "factor_laws.h"
#include "line_scene.h"
#include "plain_lines.h"

namespace plumbline::estimator {
namespace {

using core::Pose;
using core::State;
using testing::Block;
using testing::block;
using testing::FactorScene;
using testing::FactorSubject;
using testing::LineView;
using testing::SceneRequest;

const core::RandomStream kRandom({41, 0}, "line_factors_test");
const StateManifold kStateManifold;
const PoseManifold kPoseManifold;
const OrthonormalLineManifold kLineManifold;

template <class Plain, int... kSizes>
std::unique_ptr<ceres::CostFunction> automatic(const Plain& plain) {
  return std::make_unique<ceres::AutoDiffCostFunction<Plain, 2, kSizes...>>(new Plain(plain));
}

State at_rest(const Pose& T_W_B) {
  State s;
  s.T_W_B = T_W_B;
  return s;
}

// ---- the parts of a scene, moved with the world

Block moved_state(Block b, const Pose& T_new_W) {
  State s = unpack_state(b.values.data());
  s.T_W_B = T_new_W * s.T_W_B;
  s.v_W = T_new_W.q * s.v_W;
  b.values = block(pack(s)).values;
  return b;
}

Block moved_pose(Block b, const Pose& T_new_W) {
  b.values = block(pack(T_new_W * unpack_pose(b.values.data()))).values;
  return b;
}

// About the moved origin: only directions turn.
Block moved_line(Block b, const Pose& T_new_W) {
  const Eigen::Quaterniond U = T_new_W.q * Eigen::Map<const Eigen::Quaterniond>(b.values.data());
  std::copy(U.coeffs().data(), U.coeffs().data() + 4, b.values.begin());
  return b;
}

SegmentPixels noisy(SegmentPixels pixels, const SceneRequest& request) {
  for (std::uint64_t k = 0; k < 2; ++k) {
    pixels[k] += request.noise * testing::kLineSigmaPx * kRandom.normal2(1000 + request.draw, 10 * request.scene + k);
  }
  return pixels;
}

void displace_all(std::vector<Block>& blocks, const std::vector<double>& scales, std::uint64_t scene) {
  for (std::size_t k = 0; k < blocks.size(); ++k) testing::displace(blocks[k], scales[k], kRandom, 500 + scene, k);
}

// ---- subjects of the laws

FactorScene camera_scene(const LineView& v, const SceneRequest& request) {
  const CameraModel model = testing::line_model(v);
  const Eigen::Vector3d origin = request.T_new_W * v.origin_W;
  const SegmentPixels pixels = noisy(v.pixels, request);
  FactorScene s{
      std::make_unique<CameraLineFactor>(model, origin, pixels),
      automatic<testing::PlainCameraLine, kPoseSize, kLineSize>({model.camera, model.pixel_sigma_px, origin, pixels}),
      {}};
  s.blocks = {block(pack(v.state.T_W_B * v.rig.T_B_C), &kPoseManifold), block(v.line, &kLineManifold)};
  if (request.off_truth) displace_all(s.blocks, {0.02, 0.02}, request.scene);
  s.blocks[0] = moved_pose(s.blocks[0], request.T_new_W);
  s.blocks[1] = moved_line(s.blocks[1], request.T_new_W);
  return s;
}

std::vector<Block> rig_blocks(const LineView& v) {
  return {block(pack(v.state), &kStateManifold), block(pack(v.rig.T_B_C), &kPoseManifold),
          testing::scalar_block(v.rig.td_s), testing::scalar_block(v.rig.readout_s), block(v.line, &kLineManifold)};
}

void finish_rig_blocks(std::vector<Block>& blocks, const SceneRequest& request) {
  if (request.off_truth) displace_all(blocks, {0.02, 0.01, 0.002, 0.003, 0.02}, request.scene);
  blocks[0] = moved_state(blocks[0], request.T_new_W);
  blocks[4] = moved_line(blocks[4], request.T_new_W);
}

FactorScene velocity_scene(const LineView& v, const SceneRequest& request) {
  const CameraModel model = testing::line_model(v);
  const Eigen::Vector3d origin = request.T_new_W * v.origin_W;
  const SegmentPixels pixels = noisy(v.pixels, request);
  FactorScene s{std::make_unique<VelocityLineFactor>(model, origin, pixels, v.velocities, v.td_k_s),
                automatic<testing::PlainVelocityLine, kStateSize, kPoseSize, 1, 1, kLineSize>(
                    {model.camera, model.pixel_sigma_px, origin, pixels, v.velocities, v.td_k_s}),
                {}};
  s.blocks = rig_blocks(v);
  finish_rig_blocks(s.blocks, request);
  return s;
}

FactorScene propagated_scene(const LineView& v, const SceneRequest& request) {
  const CameraModel model = testing::line_model(v);
  const Eigen::Vector3d origin = request.T_new_W * v.origin_W;
  const SegmentPixels pixels = noisy(v.pixels, request);
  std::vector<Block> blocks = rig_blocks(v);
  finish_rig_blocks(blocks, request);
  // The samples lie in step with small differences of td and readout only as long as no sample is crossed.
  blocks[2].ridders_step = blocks[3].ridders_step = 2e-5;
  blocks[0].ridders_step = blocks[1].ridders_step = 3e-4;
  // Propagation is linear in the biases about those of the table: the state's own, where both are the same.
  const core::ImuBias bias = unpack_state(blocks[0].values.data()).bias;
  const auto motion = std::make_shared<LocalMotion>(*v.samples, v.state_index, 0.1, bias);
  using Plain = testing::PlainPropagatedLine<testing::PlainCarriedBody>;
  FactorScene s{std::make_unique<PropagatedLineFactor>(model, FrameTiming{motion, v.offset_s}, origin, pixels),
                automatic<Plain, kStateSize, kPoseSize, 1, 1, kLineSize>(
                    {model.camera, model.pixel_sigma_px, origin, pixels, v.offset_s,
                     testing::PlainCarriedBody{v.samples, v.state_index, model.gravity_m_s2}}),
                std::move(blocks)};
  return s;
}

// A line that passes its own origin at 1 mm (w1 small), one 500 m away, and a global shutter.
template <class Scene>
std::vector<FactorScene> limits(const Scene& scene, const LineView& base) {
  const Pose T_W_C = base.state.T_W_B * base.rig.T_B_C;
  const auto view = [&](const Eigen::Vector3d& C, const Eigen::Vector3d& D) {
    LineView v = base;
    v.line = testing::line_block(T_W_C * C, T_W_C * D, v.origin_W).value();
    return v;
  };
  LineView near = view({-0.3, 0.1, 2.0}, {0.4, 0.2, 2.5});
  near.origin_W = T_W_C * Eigen::Vector3d(-0.3, 0.1, 2.001);
  near.line = testing::line_block(T_W_C * Eigen::Vector3d(-0.3, 0.1, 2.0), T_W_C * Eigen::Vector3d(0.4, 0.2, 2.5),
                                  near.origin_W)
                  .value();
  LineView global = base;
  global.rig.readout_s = 0.0;
  LineView negative = base;
  negative.rig.readout_s = -0.001;
  std::vector<FactorScene> scenes;
  for (const LineView& v : {near, view({-80.0, 20.0, 500.0}, {100.0, 40.0, 500.0}), global, negative}) {
    scenes.push_back(scene(v, SceneRequest{}));
  }
  return scenes;
}

std::vector<FactorSubject> subjects() {
  const auto moving = [](std::uint64_t i) { return testing::handheld_line(i); };
  const auto sliding = [](std::uint64_t i) { return testing::sliding_line(i); };
  const auto still = [](std::uint64_t i) { return testing::still_line(i); };
  return {
      {.name = "Camera",
       .scene = [still](const SceneRequest& r) { return camera_scene(still(r.scene), r); },
       .limits = [still] { return limits(camera_scene, still(0)); }},
      // The model neglects that the row's noise moves the observation in time: flow * readout/rows, 1 %.
      {.name = "FeatureVelocity",
       .scene = [sliding](const SceneRequest& r) { return velocity_scene(sliding(r.scene), r); },
       .limits = [sliding] { return limits(velocity_scene, sliding(0)); },
       .whitening_slack = 0.02},
      // At the truth what is left is the integration over the gap, 1e-6 m.
      {.name = "Propagated",
       .scene = [moving](const SceneRequest& r) { return propagated_scene(moving(r.scene), r); },
       .limits = [moving] { return limits(propagated_scene, moving(0)); },
       .zero_tolerance = 1e-3},
  };
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
  const std::vector<Block> blocks = {block(pack(h.state.T_W_B), &kPoseManifold), block(h.line, &kLineManifold)};
  EXPECT_LT((testing::residual(factor, blocks) - h.r).norm(), 1e-14);
  const Eigen::MatrixXd J = testing::tangent_jacobian(factor, blocks, 0);
  EXPECT_LT((J.leftCols<3>() - h.by_p).cwiseAbs().maxCoeff(), kPrinted);
  EXPECT_LT((J.rightCols<3>() - h.by_theta).cwiseAbs().maxCoeff(), kPrinted);
  EXPECT_LT((testing::tangent_jacobian(factor, blocks, 1) - h.by_line).cwiseAbs().maxCoeff(), kPrinted);
}

TEST(LineFactors, HandWorkedBodyChainAndTimeOffset) {
  const HandWorked h;
  const VelocityLineFactor factor(h.model, Eigen::Vector3d::Zero(), h.pixels, h.velocities, 0.0);
  const std::vector<Block> blocks = {block(pack(h.state), &kStateManifold), block(pack(Pose{}), &kPoseManifold),
                                     testing::scalar_block(0.0), testing::scalar_block(0.0),
                                     block(h.line, &kLineManifold)};
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
  const std::vector<Block> blocks = {block(pack(h.state), &kStateManifold), block(pack(Pose{}), &kPoseManifold),
                                     testing::scalar_block(0.3), testing::scalar_block(0.0),
                                     block(h.line, &kLineManifold)};
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
  const CameraLineFactor direct(model, v.origin_W, noisy(v.pixels, {.noise = 1.0}));
  const VelocityLineFactor chain(model, v.origin_W, noisy(v.pixels, {.noise = 1.0}), {}, 0.0);
  const std::vector<Block> camera = {block(pack(T_W_C), &kPoseManifold), block(v.line, &kLineManifold)};
  const std::vector<Block> body = {block(pack(at_rest(T_W_C)), &kStateManifold), block(pack(Pose{}), &kPoseManifold),
                                   testing::scalar_block(0.0), testing::scalar_block(0.0),
                                   block(v.line, &kLineManifold)};
  EXPECT_LT((testing::residual(direct, camera) - testing::residual(chain, body)).norm(), 1e-10);
  const Eigen::MatrixXd J_direct = testing::tangent_jacobian(direct, camera, 0);
  const Eigen::MatrixXd J_body = testing::tangent_jacobian(chain, body, 0).leftCols<6>();
  EXPECT_LT((J_direct - J_body).norm() / J_direct.norm(), 1e-12);
}

// At r = 0 and tau = 0 both timing models are one: the velocity of the end point is the motion of the camera.
TEST(LineFactors, BothTimingModelsAgreeOnTheLineAtTheState) {
  const LineView v = testing::handheld_line(2, 0.0, 0.0);
  const FactorScene propagated = propagated_scene(v, {});
  const FactorScene velocity = velocity_scene(v, {});
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
  const FactorScene s = propagated_scene(v, {});
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
      const FirstEnd end = first_end(v, testing::kLineSigmaPx * kRandom.normal2(2000 + k, i));
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
    scenes.push_back(camera_scene(v, {}));
    scenes.push_back(velocity_scene(v, {}));
    scenes.push_back(propagated_scene(v, {}));
  }
  // In the plane z = 0 of the camera, so that its image is at infinity (l1 = l2 = 0); and through the camera's centre.
  // Both about an origin that they miss, with the camera at the world's origin.
  for (const double y : {1.0, 0.0}) {
    LineView v = testing::still_line(1);
    v.state.T_W_B = {};
    v.rig.T_B_C = {};
    v.origin_W = {0.0, 0.0, 1.0};
    v.line = testing::line_block({-1.0, y, 0.0}, {1.0, y, 0.0}, v.origin_W).value();
    scenes.push_back(camera_scene(v, {}));
    scenes.push_back(velocity_scene(v, {}));
    scenes.push_back(propagated_scene(v, {}));
  }
  for (std::size_t i = 0; i < scenes.size(); ++i) {
    Eigen::Vector2d r;
    EXPECT_FALSE(scenes[i].factor->Evaluate(testing::pointers(scenes[i].blocks).data(), r.data(), nullptr)) << i;
  }
}

TEST(LineFactors, LeavingTheLocalMotionIsFalse) {
  FactorScene s = propagated_scene(testing::handheld_line(1), {});
  s.blocks[2].values[0] = 0.5;
  Eigen::Vector2d r;
  EXPECT_FALSE(s.factor->Evaluate(testing::pointers(s.blocks).data(), r.data(), nullptr));
}

}  // namespace
}  // namespace plumbline::estimator

namespace plumbline::testing {
INSTANTIATE_TEST_SUITE_P(Lines, FactorLaws, ::testing::ValuesIn(estimator::subjects()), subject_name);
}  // namespace plumbline::testing
