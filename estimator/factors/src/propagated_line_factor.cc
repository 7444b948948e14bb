#include <cmath>
#include <optional>
#include <utility>

#include "core/calibration.h"
#include "estimator/factors/line_chain.h"
#include "estimator/factors/line_factors.h"
#include "estimator/factors/line_jacobians.h"

namespace plumbline::estimator {
namespace {

// Derivatives by the body's pose at tau, carried back to the state: the transpose of d pose(tau)/d state.
void write_state_row(const Eigen::Vector3d& position, const Eigen::Vector3d& rotation, const core::State& state,
                     const LocalPose& local, const LocalPoseJacobians& bias, double tau_s, double* out) {
  if (out == nullptr) return;
  const Eigen::Vector3d position_body = state.T_W_B.q.conjugate() * position;
  write_pose_row(position, local.R * rotation + local.p.cross(position_body), state.T_W_B.q, out);
  Eigen::Map<Eigen::Vector3d>{out + kPoseSize} = tau_s * position;
  Eigen::Map<Eigen::Vector3d>{out + kPoseSize + 3} =
      bias.p_bg.transpose() * position_body + bias.R_bg.transpose() * rotation;
  Eigen::Map<Eigen::Vector3d>{out + kPoseSize + 6} = bias.p_ba.transpose() * position_body;
}

// All that the end points of a segment share.
struct Scene {
  const CameraModel& model;
  const FrameTiming& frame;
  Eigen::Vector3d origin_W;
  core::State state;
  core::Pose T_B_C;
  Eigen::Matrix3d R_B_C;
  double td_s;
  double readout_s;
  PluckerLine line;
};

Scene scene_of(const CameraModel& model, const FrameTiming& frame, const Eigen::Vector3d& origin_W,
               const OrthonormalLine& line, double const* const* parameters) {
  const core::Pose T_B_C = unpack_pose(parameters[1]);
  return {.model = model,
          .frame = frame,
          .origin_W = origin_W,
          .state = unpack_state(parameters[0]),
          .T_B_C = T_B_C,
          .R_B_C = T_B_C.q.toRotationMatrix(),
          .td_s = *parameters[2],
          .readout_s = *parameters[3],
          .line = line.plucker()};
}

// The foot of the perpendicular from an observed end point on the curve F = 0, and the body then.
struct CurveFoot {
  Eigen::Vector2d offset_px = Eigen::Vector2d::Zero();  // foot - observed
  double phase = 0.0;
  double tau_s = 0.0;
  TimedBody body;
  LocalPoseJacobians bias;
  double distance_px = 0.0;
  double gradient_norm = 0.0;  // |grad F|, per pixel
};

Eigen::Vector3d bearing_at(const LineEndPoint& end, const Eigen::Vector2d& offset_px) {
  Eigen::Vector3d b = end.b;
  b.head<2>() += end.D * offset_px;
  return b;
}

LineChain chain_at(const Scene& scene, const TimedBody& body) {
  return {scene.line, body.R, body.p - scene.origin_W, scene.R_B_C, scene.T_B_C.p};
}

double rate_along(const LineGradient& gradient, const LineChain& chain, const TimedBody& body) {
  return gradient.body_position(chain).dot(body.velocity) + gradient.body_rotation(chain).dot(body.local.omega);
}

// One step: the body at the time of the present foot's row, and the foot on the curve's tangent there. The change of
// the foot, or nothing where the factor has no value.
std::optional<Eigen::Vector2d> step_to_foot(const Scene& scene, const LineEndPoint& end, bool with_bias,
                                            CurveFoot& foot) {
  const int rows = scene.model.camera.height_px;
  foot.phase = core::row_phase(end.pixel.y() + foot.offset_px.y(), rows);
  foot.tau_s = scene.frame.offset_s + scene.td_s + foot.phase * scene.readout_s;
  if (!body_at(*scene.frame.motion, scene.state, scene.model.gravity_m_s2, foot.tau_s, foot.body,
               with_bias ? &foot.bias : nullptr)) {
    return std::nullopt;
  }
  const LineChain chain = chain_at(scene, foot.body);
  const Eigen::Vector3d b = bearing_at(end, foot.offset_px);
  const double F_tau = rate_along(LineGradient(chain, b), chain, foot.body);
  const Eigen::Vector2d chord = end.D.transpose() * chain.n_c.head<2>();
  const Eigen::Vector2d gradient = chord + Eigen::Vector2d(0.0, F_tau * scene.readout_s / rows);
  foot.gradient_norm = gradient.norm();
  // Below a tenth the line races the shutter, and its curve has no normal to speak of.
  if (!(chord.norm() > kSmallestLineGradient * chain.n_c.norm() * end.D.norm()) ||
      !(foot.gradient_norm > 0.1 * chord.norm())) {
    return std::nullopt;
  }
  foot.distance_px = (chain.n_c.dot(b) - gradient.dot(foot.offset_px)) / foot.gradient_norm;
  if (!std::isfinite(foot.distance_px)) return std::nullopt;
  const Eigen::Vector2d offset_px = gradient * (-foot.distance_px / foot.gradient_norm);
  Eigen::Vector2d change = offset_px - foot.offset_px;
  foot.offset_px = offset_px;
  return change;
}

// A step shrinks the error of the foot by the turn of the normal over the residual, 1e-4 a pixel: three steps for the
// residuals of noise. The tolerance is a time of 1e-12 s.
bool find_foot(const Scene& scene, const LineEndPoint& end, bool with_bias, CurveFoot& foot) {
  constexpr int kMaxIterations = 10;
  constexpr double kTolerancePx = 1e-8;
  for (int iteration = 0; iteration < kMaxIterations; ++iteration) {
    const auto change = step_to_foot(scene, end, with_bias, foot);
    if (!change) return false;
    if (std::abs(change->y()) < kTolerancePx || scene.readout_s == 0.0) {
      foot.phase = core::row_phase(end.pixel.y() + foot.offset_px.y(), scene.model.camera.height_px);
      return true;
    }
  }
  return false;
}

}  // namespace

PropagatedLineFactor::PropagatedLineFactor(const CameraModel& model, FrameTiming frame, const Eigen::Vector3d& origin_W,
                                           const SegmentPixels& observed)
    : model_(model), frame_(std::move(frame)), origin_W_(origin_W), ends_(line_end_points(model.camera, observed)) {}

bool PropagatedLineFactor::Evaluate(double const* const* parameters, double* residuals, double** jacobians) const {
  const OrthonormalLine line(parameters[4]);
  if (line.degenerate()) return false;
  const Scene scene = scene_of(model_, frame_, origin_W_, line, parameters);
  const LineRows rows(jacobians);
  const bool with_bias = rows.row(0, kStateSize, 0) != nullptr;
  for (int k = 0; k < 2; ++k) {
    CurveFoot foot;
    if (!find_foot(scene, ends_[k], with_bias, foot)) return false;
    residuals[k] = foot.distance_px / model_.pixel_sigma_px;
    if (!rows.any()) continue;
    const LineChain chain = chain_at(scene, foot.body);
    const double scale = 1.0 / (foot.gradient_norm * model_.pixel_sigma_px);
    const LineGradient gradient(chain, scale * bearing_at(ends_[k], foot.offset_px));
    write_state_row(gradient.body_position(chain), gradient.body_rotation(chain), scene.state, foot.body.local,
                    foot.bias, foot.tau_s, rows.row(0, kStateSize, k));
    write_pose_row(gradient.extrinsic_position(chain), gradient.extrinsic_rotation(chain), scene.T_B_C.q,
                   rows.row(1, kPoseSize, k));
    const double J_td = rate_along(gradient, chain, foot.body);
    write_scalar(J_td, rows.row(2, 1, k));
    write_scalar(foot.phase * J_td, rows.row(3, 1, k));
    write_line_row(line, chain, gradient, rows.row(4, kLineSize, k));
  }
  return true;
}

std::optional<SegmentPixels> PropagatedLineFactor::feet(double const* const* parameters) const {
  const OrthonormalLine line(parameters[4]);
  if (line.degenerate()) return std::nullopt;
  const Scene scene = scene_of(model_, frame_, origin_W_, line, parameters);
  SegmentPixels pixels;
  for (std::size_t k = 0; k < 2; ++k) {
    CurveFoot foot;
    if (!find_foot(scene, ends_[k], false, foot)) return std::nullopt;
    pixels[k] = ends_[k].pixel + foot.offset_px;
  }
  return pixels;
}

}  // namespace plumbline::estimator
