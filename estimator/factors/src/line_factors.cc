#include "estimator/factors/line_factors.h"

#include "core/calibration.h"
#include "estimator/factors/line_chain.h"
#include "estimator/factors/line_jacobians.h"

namespace plumbline::estimator {

CameraLineFactor::CameraLineFactor(const CameraModel& model, const Eigen::Vector3d& origin_W,
                                   const SegmentPixels& observed)
    : inv_sigma_px_(1.0 / model.pixel_sigma_px), origin_W_(origin_W), ends_(line_end_points(model.camera, observed)) {}

bool CameraLineFactor::Evaluate(double const* const* parameters, double* residuals, double** jacobians) const {
  const core::Pose T_W_C = unpack_pose(parameters[0]);
  const OrthonormalLine line(parameters[1]);
  if (line.degenerate()) return false;
  // The camera is its own body.
  const LineChain chain(line.plucker(), T_W_C.q.toRotationMatrix(), T_W_C.p - origin_W_, Eigen::Matrix3d::Identity(),
                        Eigen::Vector3d::Zero());
  const LineRows rows(jacobians);
  for (int k = 0; k < 2; ++k) {
    LineDistance distance;
    if (!line_distance(chain.n_c, ends_[k].b, ends_[k].D, distance)) return false;
    residuals[k] = inv_sigma_px_ * distance.r_px;
    if (!rows.any()) continue;
    const LineGradient gradient(chain, inv_sigma_px_ * distance.dr_dn);
    write_pose_row(gradient.body_position(chain), gradient.body_rotation(chain), T_W_C.q, rows.row(0, kPoseSize, k));
    write_line_row(line, chain, gradient, rows.row(1, kLineSize, k));
  }
  return true;
}

VelocityLineFactor::VelocityLineFactor(const CameraModel& model, const Eigen::Vector3d& origin_W,
                                       const SegmentPixels& observed, const SegmentVelocities& velocities,
                                       double td_k_s)
    : inv_sigma_px_(1.0 / model.pixel_sigma_px),
      rows_(model.camera.height_px),
      td_k_s_(td_k_s),
      origin_W_(origin_W),
      ends_(line_end_points(model.camera, observed)),
      velocities_(velocities) {}

bool VelocityLineFactor::Evaluate(double const* const* parameters, double* residuals, double** jacobians) const {
  const core::Pose T_W_B = unpack_pose(parameters[0]);
  const core::Pose T_B_C = unpack_pose(parameters[1]);
  const double td = *parameters[2];
  const double readout = *parameters[3];
  const OrthonormalLine line(parameters[4]);
  if (line.degenerate()) return false;
  const LineChain chain(line.plucker(), T_W_B.q.toRotationMatrix(), T_W_B.p - origin_W_, T_B_C.q.toRotationMatrix(),
                        T_B_C.p);
  const LineRows rows(jacobians);
  for (int k = 0; k < 2; ++k) {
    const double phase = core::row_phase(ends_[k].pixel.y(), rows_);
    Eigen::Vector3d b = ends_[k].b;
    b.head<2>() -= (td - td_k_s_ + phase * readout) * velocities_[k];
    LineDistance distance;
    if (!line_distance(chain.n_c, b, ends_[k].D, distance)) return false;
    residuals[k] = inv_sigma_px_ * distance.r_px;
    if (!rows.any()) continue;
    const LineGradient gradient(chain, inv_sigma_px_ * distance.dr_dn);
    if (double* J = rows.row(0, kStateSize, k); J != nullptr) {
      write_pose_row(gradient.body_position(chain), gradient.body_rotation(chain), T_W_B.q, J);
      Eigen::Map<Eigen::Matrix<double, kStateSize - kPoseSize, 1>>{J + kPoseSize}.setZero();
    }
    write_pose_row(gradient.extrinsic_position(chain), gradient.extrinsic_rotation(chain), T_B_C.q,
                   rows.row(1, kPoseSize, k));
    const Eigen::Vector2d normal = ends_[k].D.transpose() * chain.n_c.head<2>();
    const double J_td = -inv_sigma_px_ * chain.n_c.head<2>().dot(velocities_[k]) / normal.norm();
    write_scalar(J_td, rows.row(2, 1, k));
    write_scalar(phase * J_td, rows.row(3, 1, k));
    write_line_row(line, chain, gradient, rows.row(4, kLineSize, k));
  }
  return true;
}

}  // namespace plumbline::estimator
