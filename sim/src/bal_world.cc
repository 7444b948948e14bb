#include "sim/bal_world.h"

#include <cmath>
#include <numbers>
#include <optional>
#include <utility>
#include <vector>

#include "core/lie.h"

namespace plumbline::sim {
namespace {

using core::BalCamera;

// A camera at `centre` that looks (down its -z axis) at `target`, the world's z axis upwards in the picture.
BalCamera looking_at(const Eigen::Vector3d& centre, const Eigen::Vector3d& target) {
  const Eigen::Vector3d back = (centre - target).normalized();
  const Eigen::Vector3d right = Eigen::Vector3d::UnitZ().cross(back).normalized();
  Eigen::Matrix3d R_C_W;
  R_C_W << right.transpose(), back.cross(right).transpose(), back.transpose();
  BalCamera camera;
  camera.w = core::log_so3(Eigen::Quaterniond(R_C_W));
  camera.t = -(R_C_W * centre);
  return camera;
}

std::vector<BalCamera> make_cameras(const BalWorldConfig& config, core::TrialId id) {
  const core::RandomStream stream(id.shared(), "bal/camera");
  std::vector<BalCamera> cameras;
  for (int k = 0; k < config.cameras; ++k) {
    const auto i = static_cast<std::uint64_t>(k);
    const double angle = 2.0 * std::numbers::pi * k / config.cameras;
    const double wave = 0.1 * config.ring_radius_m;
    const double radius = config.ring_radius_m + wave * std::sin(3.0 * angle);
    const Eigen::Vector3d centre(radius * std::cos(angle), radius * std::sin(angle), wave * std::sin(2.0 * angle));
    const Eigen::Vector3d target = 0.2 * config.ball_radius_m * stream.normal3(i, 0);
    BalCamera camera = looking_at(centre, target);
    const auto u = stream.uniforms(i, 1);
    camera.intrinsics = {config.f_px * (0.9 + 0.2 * u[0]), -0.1 + 0.1 * u[1], 0.02 * u[2]};
    cameras.push_back(camera);
  }
  return cameras;
}

std::vector<Eigen::Vector3d> make_points(const BalWorldConfig& config, core::TrialId id) {
  const core::RandomStream stream(id.shared(), "bal/point");
  std::vector<Eigen::Vector3d> points;
  for (int k = 0; k < config.points; ++k) {
    const auto i = static_cast<std::uint64_t>(k);
    const double radius = config.ball_radius_m * std::cbrt(stream.uniform(i, 1));
    points.push_back(radius * stream.normal3(i, 0).normalized());
  }
  return points;
}

std::optional<Eigen::Vector2d> sees(const BalCamera& camera, const Eigen::Vector3d& X, double half_picture_px) {
  if (!core::in_front(camera, core::ViewAxis::kMinusZ, X)) return std::nullopt;
  auto pixel = core::project_bal(camera.intrinsics, core::ViewAxis::kMinusZ, core::exp_so3(camera.w) * X + camera.t);
  if (!pixel || pixel->cwiseAbs().maxCoeff() > half_picture_px) return std::nullopt;
  return pixel;
}

// Points that two cameras at least see, and who sees them.
void observe(const std::vector<Eigen::Vector3d>& points, double half_picture_px, core::BalProblem& truth) {
  for (const Eigen::Vector3d& X : points) {
    std::vector<core::BalObservation> seen;
    for (std::size_t k = 0; k < truth.cameras.size(); ++k) {
      if (const auto pixel = sees(truth.cameras[k], X, half_picture_px)) {
        seen.push_back({static_cast<int>(k), static_cast<int>(truth.points.size()), *pixel});
      }
    }
    if (seen.size() < 2) continue;
    truth.points.push_back(X);
    truth.observations.insert(truth.observations.end(), seen.begin(), seen.end());
  }
}

BalCamera moved(const BalCamera& camera, const BalWorldConfig& config, const core::RandomStream& start,
                std::uint64_t i) {
  const Eigen::Vector3d centre = camera.centre() + config.start_position_sigma_m * start.normal3(i, 1);
  const Eigen::Quaterniond q =
      core::exp_quaternion(config.start_rotation_sigma_rad * start.normal3(i, 0)) * core::exp_quaternion(camera.w);
  BalCamera result = camera;
  result.w = core::log_so3(q);
  result.t = -(q * centre);
  result.intrinsics.f_px *= 1.0 + config.start_focal_sigma * start.normal(i, 2);
  return result;
}

}  // namespace

BalSimulation simulate_bal(const BalWorldConfig& config, core::TrialId id) {
  BalSimulation simulation;
  core::BalProblem& truth = simulation.truth;
  truth.cameras = make_cameras(config, id);
  observe(make_points(config, id), config.half_picture_px, truth);

  core::BalProblem& problem = simulation.problem;
  const core::RandomStream noise(id, "bal/pixel");
  const core::RandomStream camera_start(id, "bal/start_camera");
  const core::RandomStream point_start(id, "bal/start_point");
  for (std::size_t i = 0; i < truth.observations.size(); ++i) {
    problem.observations.push_back(truth.observations[i]);
    problem.observations.back().pixel += config.pixel_sigma_px * noise.normal2(i);
  }
  for (std::size_t i = 0; i < truth.cameras.size(); ++i) {
    problem.cameras.push_back(moved(truth.cameras[i], config, camera_start, i));
  }
  for (std::size_t i = 0; i < truth.points.size(); ++i) {
    problem.points.push_back(truth.points[i] + config.start_point_sigma_m * point_start.normal3(i));
  }
  return simulation;
}

}  // namespace plumbline::sim
