#include "estimator/triangulation.h"

#include <algorithm>

namespace plumbline::estimator {

Eigen::Vector3d triangulate(const core::PinholeCamera& camera, const std::vector<View>& views) {
  constexpr double kNearestM = 0.2;
  constexpr double kFarthestM = 100.0;
  const Eigen::Vector3d bearing = camera.unproject(views.front().pixel);
  double numerator = 0.0;
  double denominator = 0.0;
  for (auto view = views.begin() + 1; view != views.end(); ++view) {
    const core::Pose T_C_A = view->T_W_C.inverse() * views.front().T_W_C;
    const Eigen::Vector3d a = T_C_A.q * bearing;
    const Eigen::Vector3d& c = T_C_A.p;
    const Eigen::Vector2d z = camera.unproject(view->pixel).head<2>();
    const Eigen::Vector2d along = c.head<2>() - z * c.z();
    numerator -= along.dot(a.head<2>() - z * a.z());
    denominator += along.squaredNorm();
  }
  const double lambda = denominator > 0.0 ? numerator / denominator : 0.0;
  return {bearing.x(), bearing.y(), std::clamp(lambda, 1.0 / kFarthestM, 1.0 / kNearestM)};
}

}  // namespace plumbline::estimator
