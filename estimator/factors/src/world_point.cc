#include "estimator/factors/world_point.h"

namespace plumbline::estimator {

std::optional<WorldPointView> observe_world_point(const CameraModel& model, const FrameTiming& timing,
                                                  const core::State& state, const core::RigCalibration& calibration,
                                                  const Eigen::Vector3d& P_W, double first_row_px,
                                                  WorldPointJacobians* jacobians) {
  const RigidMotion T_B_C = rigid_motion(calibration.T_B_C);
  const RollingShutter shutter{timing.offset_s + calibration.td_s, calibration.readout_s};
  BodyPath path(*timing.motion, state, model.gravity_m_s2);
  PointChain chain(Eigen::Vector3d::UnitZ(), 1.0);
  chain.W = P_W;
  RollingView seen;
  if (!view_point(model.camera, shutter, T_B_C, first_row_px, path, chain, seen)) return std::nullopt;
  Matrix23 J_pixel;
  const auto pixel = model.camera.project(chain.q, &J_pixel);
  if (!pixel) return std::nullopt;
  const double tau_s = shutter.offset_s + seen.phase * shutter.readout_s;
  if (jacobians != nullptr) {
    const Matrix23 J_q = seen.with_row(J_pixel / model.pixel_sigma_px);
    const Matrix23 J_X = J_q * T_B_C.R.transpose();
    const Matrix23 J_W = J_X * seen.body.R.transpose();
    jacobians->state = path.chain_to_state<2>(-J_W, times_skew(J_X, chain.X));
    jacobians->extrinsics << -J_X, times_skew(J_q, chain.q);
    jacobians->td = J_q * seen.q_dot;
    jacobians->readout = seen.phase * jacobians->td;
    jacobians->intrinsics = intrinsics_jacobian(model, *pixel, calibration.readout_s, jacobians->td);
    jacobians->point = J_W;
  }
  return WorldPointView{*pixel, tau_s};
}

}  // namespace plumbline::estimator
