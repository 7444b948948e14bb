#include "estimator/factors/line_factors.h"
#include "estimator/factors/line_jacobians.h"

namespace plumbline::estimator {

bool PropagatedLineFactor::Evaluate(double const* const* parameters, double* residuals, double** jacobians) const {
  const core::State state = unpack_state(parameters[0]);
  const TimedRig rig(parameters + 1);
  const OrthonormalLine line(parameters[4]);
  if (line.degenerate()) return false;
  const LineRows rows(jacobians);
  BodyPath path(*frame_.motion, state, gravity_m_s2_);
  for (int k = 0; k < 2; ++k) {
    TimedEnd seen;
    if (!law_.see(static_cast<std::size_t>(k), rig, line, path, frame_.offset_s, seen)) return false;
    residuals[k] = seen.residual;
    if (double* const out = rows.row(0, kStateSize, k)) {
      Eigen::Map<Eigen::Matrix<double, 1, kStateSize>> ambient(out);
      lift_state_jacobian(path.chain_to_state<1>(seen.body_position.transpose(), seen.body_rotation.transpose()),
                          state.T_W_B.q, ambient);
    }
    law_.write_shared(seen, rig, line, rows, 1, k);
  }
  return true;
}

std::optional<SegmentPixels> PropagatedLineFactor::feet(double const* const* parameters) const {
  const core::State state = unpack_state(parameters[0]);
  const TimedRig rig(parameters + 1);
  const OrthonormalLine line(parameters[4]);
  if (line.degenerate()) return std::nullopt;
  BodyPath path(*frame_.motion, state, gravity_m_s2_);
  SegmentPixels pixels;
  for (std::size_t k = 0; k < 2; ++k) {
    TimedEnd seen;
    if (!law_.see(k, rig, line, path, frame_.offset_s, seen)) return std::nullopt;
    pixels[k] = law_.end(k).pixel + seen.offset_px;
  }
  return pixels;
}

}  // namespace plumbline::estimator
