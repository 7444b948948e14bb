#include "estimator/triangulation.h"

#include <algorithm>
#include <iterator>
#include <utility>

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

std::optional<Eigen::Vector3d> triangulate_agreeing(const core::PinholeCamera& camera, const std::vector<View>& views,
                                                    double gate_px) {
  const auto point_of = [&](const std::vector<View>& from) -> Eigen::Vector3d {
    const Eigen::Vector3d landmark = triangulate(camera, from);
    return from.front().T_W_C * Eigen::Vector3d(landmark.head<2>().homogeneous() / landmark.z());
  };
  const auto in_camera = [](const View& view, const Eigen::Vector3d& X) -> Eigen::Vector3d {
    return view.T_W_C.q.conjugate() * (X - view.T_W_C.p);
  };
  const std::size_t last = views.size() - 1;
  std::vector<View> most;
  for (const auto& [i, j] : {std::pair<std::size_t, std::size_t>{0, last}, {0, last / 2}, {last / 2, last}}) {
    if (i == j) continue;
    const Eigen::Vector3d X = point_of({views[i], views[j]});
    std::vector<View> agreeing;
    std::copy_if(views.begin(), views.end(), std::back_inserter(agreeing), [&](const View& view) {
      const auto pixel = camera.project(in_camera(view, X));
      return pixel && (*pixel - view.pixel).norm() < gate_px;
    });
    if (agreeing.size() > most.size()) most = std::move(agreeing);
  }
  if (most.size() < 2 || 2 * most.size() < views.size()) return std::nullopt;
  const Eigen::Vector3d q = in_camera(views.front(), point_of(most));
  if (!(q.z() > 0.0)) return std::nullopt;
  return Eigen::Vector3d(q.x() / q.z(), q.y() / q.z(), 1.0 / q.z());
}

}  // namespace plumbline::estimator
