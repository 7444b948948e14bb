#include "estimator/estimate.h"

#include <algorithm>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "core/error.h"
#include "core/physical_ranges.h"
#include "estimator/batch.h"
#include "estimator/batch_start.h"
#include "estimator/factors/imu_increment.h"
#include "estimator/from_scratch.h"
#include "estimator/sliding_window.h"

namespace plumbline::estimator {
namespace {

// What the estimator divides by.
void require_weight(double value, std::string_view key, std::string_view meaning) {
  if (!(value >= core::kLeastSigma)) {
    throw core::RuleError({std::string(key), fmt::format("must be >= {} for the estimator ({} is {})",
                                                         core::kLeastSigma, meaning, value)});
  }
}

// Between two samples the IMU is taken as linear. Over a longer gap that says nothing of the motion any more, and no
// noise density tells how wrong it is.
constexpr double kLargestImuGapS = 0.1;

// The reason not to estimate, if there is one.
std::optional<std::string> gap_in_imu(const std::vector<core::ImuSample>& imu) {
  for (std::size_t i = 1; i < imu.size(); ++i) {
    const double gap_s = core::to_seconds(imu[i].t_ns - imu[i - 1].t_ns);
    if (gap_s > kLargestImuGapS) {
      return fmt::format("no IMU samples for {:.3f} s after {} ns, the longest gap that is bridged is {} s", gap_s,
                         imu[i - 1].t_ns, kLargestImuGapS);
    }
  }
  return std::nullopt;
}

core::EstimateLog estimate_from_prior(const core::MeasurementLog& log, const EstimatorConfig& config,
                                      std::size_t first_frame = 0) {
  switch (config.type) {
    case EstimatorType::kBatch:
      return estimate_batch(log, config);
    case EstimatorType::kSlidingWindow:
      return estimate_in_window(log, config, first_frame);
    case EstimatorType::kInitialisation:
    case EstimatorType::kExternal:
      break;  // neither is from a prior, the one because it has none, the other because it is not ours
  }
  throw std::logic_error("estimate: unknown type");
}

// The batch's first state is the recording's.
void carry_to_the_first_sample(const core::MeasurementLog& log, core::InitialPrior& prior) {
  const std::size_t sample = nearest_sample(log.imu, 0.0, prior.t_ns);
  prior.start = carry(prior.start, log.imu, sample, 0, log.gravity_m_s2);
  prior.mean.T_W_B = prior.start.T_W_B;
  prior.mean.v_W = prior.start.v_W;
  prior.t_ns = log.imu.front().t_ns;
}

core::EstimateLog estimate_from_scratch(const core::MeasurementLog& log, const EstimatorConfig& config) {
  EstimatorConfig on_states = config;  // a window has no knots
  if (config.timing == TimingModel::kSpline) on_states.timing = TimingModel::kPropagated;
  FromScratch scratch = initialise_from_scratch(log, on_states);
  if (!scratch.found || config.type == EstimatorType::kInitialisation) return std::move(scratch.log);
  core::MeasurementLog begun = log;
  begun.prior = scratch.prior;
  if (config.type == EstimatorType::kBatch) carry_to_the_first_sample(log, begun.prior);
  core::EstimateLog estimate = estimate_from_prior(begun, config, scratch.newest_frame);
  estimate.initialisation = std::move(scratch.log.initialisation);
  return estimate;
}

}  // namespace

void require_usable(const EstimatorConfig& config, const BelievedNoise& noise, const core::CalibrationSigmas& sigma,
                    bool has_lines) {
  if (config.timing == TimingModel::kSpline && config.type != EstimatorType::kBatch) {
    throw core::RuleError({"estimator.timing", "spline needs estimator.type: batch"});
  }
  const EstimateWhat& free = config.estimate;
  const std::string_view fallback = "it defaults to the scenario's, which";
  if (uses_points(config.use)) require_weight(noise.pixel_sigma_px, "estimator.pixel_sigma_px", fallback);
  if (uses_lines(config.use) && has_lines) require_weight(noise.line_sigma_px, "estimator.line_sigma_px", fallback);
  require_weight(noise.imu.gyro_noise_density, "estimator.imu.gyro_noise_density_rad_s_sqrt_hz", fallback);
  require_weight(noise.imu.gyro_bias_walk, "estimator.imu.gyro_bias_walk_rad_s2_sqrt_hz", fallback);
  require_weight(noise.imu.accel_noise_density, "estimator.imu.accel_noise_density_m_s2_sqrt_hz", fallback);
  require_weight(noise.imu.accel_bias_walk, "estimator.imu.accel_bias_walk_m_s3_sqrt_hz", fallback);
  if (starts_from_scratch(config) && !uses_points(config.use)) {
    throw core::RuleError({"estimator.use", "must have points where the estimator starts from scratch"});
  }
  const std::string_view width = "a free parameter needs a prior with a width, which";
  if (free.td) require_weight(sigma.td_s, "scenario.prior.td_sigma_s", width);
  if (free.readout) require_weight(sigma.readout_s, "scenario.prior.readout_sigma_s", width);
  if (free.extrinsics) {
    require_weight(sigma.extrinsic_position_m, "scenario.prior.extrinsic_position_sigma_m", width);
    require_weight(sigma.extrinsic_rotation_rad, "scenario.prior.extrinsic_rotation_sigma_rad", width);
  }
  if (free.intrinsics) {
    const bool points_alone = uses_points(config.use) && !(uses_lines(config.use) && has_lines);
    if (config.type != EstimatorType::kSlidingWindow || config.timing != TimingModel::kPropagated ||
        config.residual != ResidualType::kPinhole || config.landmark != LandmarkType::kBearingInverseDepth ||
        !points_alone) {
      throw core::RuleError({"estimator.estimate.intrinsics",
                             "needs estimator.type: sliding_window, timing: propagated, residual: pinhole, landmark: "
                             "bearing_inverse_depth, and points without lines"});
    }
    require_weight(sigma.focal_px, "scenario.prior.focal_sigma_px", width);
    require_weight(sigma.principal_point_px, "scenario.prior.principal_point_sigma_px", width);
  }
}

core::EstimateLog estimate(const core::MeasurementLog& log, const EstimatorConfig& config) {
  const bool has_lines =
      std::any_of(log.frames.begin(), log.frames.end(), [](const core::Frame& frame) { return !frame.lines.empty(); });
  require_usable(config, believed_noise(config, log.imu_noise, log.pixel_sigma_px, log.line_sigma_px),
                 log.prior.calibration_sigma, has_lines);
  if (auto reason = gap_in_imu(log.imu)) {
    core::EstimateLog failed;
    failed.status = core::SolveStatus::kFailedInitialisation;
    failed.reason = std::move(*reason);
    return failed;
  }
  return starts_from_scratch(config) ? estimate_from_scratch(log, config) : estimate_from_prior(log, config);
}

}  // namespace plumbline::estimator
