#include "sim/prior.h"

#include <array>

namespace plumbline::sim {
namespace {

struct Draw {
  core::State state;
  core::RigCalibration calibration;
};

Draw draw(const GroundTruth& truth, const core::StateSigmas& sigma, const core::CalibrationSigmas& calibration_sigma,
          const core::RandomStream& stream) {
  core::StateTangent noise;
  for (Eigen::Index block = 0; block < 5; ++block) {
    noise.segment<3>(3 * block) = stream.normal3(static_cast<std::uint64_t>(block));
  }
  const Eigen::Vector3d extrinsic_position = stream.normal3(5);
  const Eigen::Vector3d extrinsic_rotation = stream.normal3(6);
  core::RigCalibration calibration = truth.calibration;
  calibration.T_B_C.p += calibration_sigma.extrinsic_position_m * extrinsic_position;
  calibration.T_B_C.q =
      (calibration.T_B_C.q * core::exp_quaternion(calibration_sigma.extrinsic_rotation_rad * extrinsic_rotation))
          .normalized();
  calibration.td_s += calibration_sigma.td_s * stream.normal(7);
  calibration.readout_s += calibration_sigma.readout_s * stream.normal(8);
  if (calibration.intrinsics) {
    const std::array<double, 4> n = stream.normals(9);
    *calibration.intrinsics +=
        core::Intrinsics(calibration_sigma.focal_px * n[0], calibration_sigma.focal_px * n[1],
                         calibration_sigma.principal_point_px * n[2], calibration_sigma.principal_point_px * n[3]);
  }
  return {core::plus(truth.states.front().state, noise.cwiseProduct(sigma.per_axis())), calibration};
}

}  // namespace

core::InitialPrior make_prior(const GroundTruth& truth, const ScenarioConfig& config, core::TrialId id) {
  const PriorConfig& p = config.prior;
  core::InitialPrior prior;
  prior.t_ns = truth.states.front().t_ns;
  prior.sigma = p.state_sigmas();
  prior.calibration_sigma = p.calibration_sigmas();

  const Draw exact{truth.states.front().state, truth.calibration};
  Draw mean = p.means == PriorMeans::kTruth
                  ? exact
                  : draw(truth, prior.sigma, prior.calibration_sigma, core::RandomStream(id, "prior/mean"));
  if (p.td_mean_s) mean.calibration.td_s = *p.td_mean_s;
  if (p.readout_mean_s) mean.calibration.readout_s = *p.readout_mean_s;
  Draw start = mean;
  if (p.start == PriorStart::kDrawn) {
    start = draw(truth, prior.sigma, prior.calibration_sigma, core::RandomStream(id, "prior/start"));
  }
  prior.mean = mean.state;
  prior.calibration = mean.calibration;
  prior.start = start.state;
  prior.start_calibration = start.calibration;
  return prior;
}

}  // namespace plumbline::sim
