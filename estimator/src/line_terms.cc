#include "estimator/line_terms.h"

#include <stdexcept>

namespace plumbline::estimator {

std::unique_ptr<ceres::CostFunction> make_line_factor(const LineModel& model, const LineView& view,
                                                      const Eigen::Vector3d& origin_W) {
  if (model.timing != TimingModel::kFeatureVelocity) {
    return std::make_unique<PropagatedLineFactor>(model.camera, view.timing, origin_W, view.ends_px);
  }
  if (!view.velocities) throw std::invalid_argument("feature_velocity: a segment without velocities");
  // The state's time was formed with the td at which it lies at the frame: s_k = t_cam + td_k.
  const double td_k_s = -view.timing.offset_s;
  return std::make_unique<VelocityLineFactor>(model.camera, origin_W, view.ends_px, *view.velocities, td_k_s);
}

}  // namespace plumbline::estimator
