#include "eval/initialisation_error.h"

#include <cmath>
#include <numeric>

#include "core/lie.h"
#include "eval/alignment.h"

namespace plumbline::eval {
namespace {

double scale_error(const std::vector<core::StampedState>& states, const sim::GroundTruth& truth) {
  std::vector<Eigen::Vector3d> estimated;
  std::vector<Eigen::Vector3d> true_positions;
  for (const core::StampedState& s : states) {
    estimated.push_back(s.state.T_W_B.p);
    true_positions.push_back(sim::state_at(truth, s.t_ns).T_W_B.p);
  }
  const Similarity aligned = align(estimated, true_positions, Alignment::kPosyaw).truth_from_estimate;
  const Eigen::Vector3d sum =
      std::accumulate(true_positions.begin(), true_positions.end(), Eigen::Vector3d(Eigen::Vector3d::Zero()));
  const Eigen::Vector3d mean = sum / static_cast<double>(true_positions.size());
  double along = 0.0;
  double squares = 0.0;
  for (std::size_t k = 0; k < estimated.size(); ++k) {
    const Eigen::Vector3d arm = true_positions[k] - mean;
    along += arm.dot(aligned * estimated[k] - true_positions[k]);
    squares += arm.squaredNorm();
  }
  return along / squares;
}

}  // namespace

std::vector<Metric> initialisation_errors(const core::Initialisation& found, const sim::GroundTruth& truth) {
  const core::State& x = found.states.back().state;
  const core::State at = sim::state_at(truth, found.at_ns);
  const auto in_body = [](const core::State& s, const Eigen::Vector3d& a_W) {
    return Eigen::Vector3d(s.T_W_B.q.conjugate() * a_W);
  };
  const Eigen::Vector3d up = in_body(x, Eigen::Vector3d::UnitZ());
  const Eigen::Vector3d true_up = in_body(at, Eigen::Vector3d::UnitZ());
  Metric scale{"init_scale_error", scale_error(found.states, truth)};
  const double sigmas = scale.value / found.relative_scale_sigma;
  scale.nees = sigmas * sigmas;
  scale.nees_dof = 1;
  return {{"init_time_s", core::to_seconds(found.at_ns - found.since_ns)},
          {"init_aligned_scale_error", scale_error(found.aligned, truth)},
          scale,
          {"init_gravity_deg", core::kDegreesPerRadian * std::atan2(up.cross(true_up).norm(), up.dot(true_up))},
          {"init_velocity_m_s", (in_body(x, x.v_W) - in_body(at, at.v_W)).norm()},
          {"init_gyro_bias_rad_s", (x.bias.gyro_rad_s - at.bias.gyro_rad_s).norm()}};
}

}  // namespace plumbline::eval
