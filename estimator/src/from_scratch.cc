#include "estimator/from_scratch.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "estimator/batch_start.h"
#include "estimator/imu_path.h"
#include "estimator/keyframes.h"
#include "estimator/rotation_alignment.h"
#include "estimator/scale_alignment.h"
#include "estimator/structure_from_motion.h"
#include "estimator/window_settle.h"

namespace plumbline::estimator {
namespace {

constexpr std::size_t kLeastPictures = 8;
// Of the turns' mean squared residual, in sigmas of a ray; theirs are smaller.
constexpr double kMostTurnResidual = 4.0;
// Where geometry alone leaves the scale less certain than this, the refinement has no place to start from.
constexpr double kMostAlignedScaleSigma = 0.3;
// What the rows of a moving camera differ by once the turn between them is taken out, roughly.
constexpr double kShutterPx = 1.0;

// A first state that says little but where the world's origin is and which way is north: a solve that ends half a sigma
// from the minimum would turn the world by half of that.
constexpr core::StateSigmas kLittleKnown{.position_m = 0.01, .orientation_rad = 0.05, .velocity_m_s = 10.0};
// How long before the first picture it lies, so that td may move.
constexpr double kLeadS = 0.1;

class Attempt {
 public:
  Attempt(const core::MeasurementLog& log, const EstimatorConfig& config, std::span<const std::size_t> frames)
      : log_(log),
        config_(config),
        frames_(frames),
        noise_(believed_noise(config, log.imu_noise, log.pixel_sigma_px, log.line_sigma_px)),
        rig_(log.prior.start_calibration),
        camera_(rig_.camera(log.camera)),
        origin_ns_(log.frames[frames.front()].t_cam_ns) {
    for (const std::size_t frame : frames) {
      stamps_s_.push_back(core::to_seconds(log.frames[frame].t_cam_ns - origin_ns_));
    }
  }

  // Throws NoStart with the reason where it does not succeed.
  FromScratch run() {
    const core::InitialPrior aligned = align(structure_from_motion(pictures(), rules()));
    return refine(aligned);
  }

 private:
  StructureRules rules() const {
    return {.ray_sigma = std::hypot(noise_.pixel_sigma_px, kShutterPx) / camera_.fx_px,
            .least_parallax = config_.from_scratch.least_parallax_px / camera_.fx_px};
  }

  // z ~ R_B_C^T Exp(w dt) R_B_C z_row, dt the row's time after the middle one.
  std::vector<PictureRays> pictures() const {
    const ImuPath path = imu_path(log_.imu, origin_ns_, stamps_s_, rig_.td_s, {});
    std::vector<PictureRays> pictures;
    for (std::size_t k = 0; k < frames_.size(); ++k) {
      PictureRays& rays = pictures.emplace_back();
      const Eigen::Vector3d rate_C = rig_.T_B_C.q.conjugate() * path.rate_B[k];
      for (const core::PointObservation& o : log_.frames[frames_[k]].points) {
        const auto ray = camera_.try_unproject(o.pixel);
        if (!ray) continue;
        const double dt_s = core::row_phase(o.pixel.y(), camera_.height_px) * rig_.readout_s;
        const Eigen::Vector3d turned = core::exp_quaternion(dt_s * rate_C) * *ray;
        rays.emplace(o.track_id, turned.hnormalized());
      }
    }
    return pictures;
  }

  // The state at the first picture, as a start of what refines it.
  core::InitialPrior align(const std::vector<core::Pose>& path_C) const {
    const FromScratchConfig& scratch = config_.from_scratch;
    const core::CalibrationSigmas& sigma = log_.prior.calibration_sigma;
    std::vector<Eigen::Quaterniond> rotations;
    for (const core::Pose& pose : path_C) rotations.push_back(pose.q);
    const auto turns =
        align_rotations(log_.imu, origin_ns_, stamps_s_, rotations, rules().ray_sigma,
                        {.td_s = rig_.td_s,
                         .td_sigma_s = config_.estimate.td ? sigma.td_s : 0.0,
                         .R_B_C = rig_.T_B_C.q,
                         .R_B_C_sigma_rad = config_.estimate.extrinsics ? sigma.extrinsic_rotation_rad : 0.0,
                         .gyro_bias_sigma_rad_s = scratch.gyro_bias_sigma_rad_s});
    if (!turns || turns->residual > kMostTurnResidual) {
      throw NoStart("the camera's turns and the gyroscope's do not agree");
    }
    core::RigCalibration rig = rig_;
    rig.td_s = turns->td_s;
    rig.T_B_C.q = turns->R_B_C;
    const ImuPath path = imu_path(log_.imu, origin_ns_, stamps_s_, rig.td_s, {.gyro_rad_s = turns->gyro_bias_rad_s});
    std::vector<Eigen::Vector3d> centres;
    for (const core::Pose& pose : path_C) centres.push_back(pose.p);
    const auto scale = align_scale(path, centres, rig.T_B_C, log_.gravity_m_s2, scratch.accel_bias_sigma_m_s2);
    if (!scale || scale->relative_sigma > kMostAlignedScaleSigma) {
      throw NoStart("the scale is not observable: too little acceleration");
    }

    core::InitialPrior prior = log_.prior;
    prior.start_calibration = rig;
    prior.sigma = kLittleKnown;
    prior.sigma.gyro_bias_rad_s = scratch.gyro_bias_sigma_rad_s;
    prior.sigma.accel_bias_m_s2 = scratch.accel_bias_sigma_m_s2;
    core::State first;
    first.T_W_B.q = Eigen::Quaterniond::FromTwoVectors(-scale->gravity_B0, Eigen::Vector3d::UnitZ());
    first.v_W = first.T_W_B.q * scale->v_B0;
    first.bias = {turns->gyro_bias_rad_s, scale->accel_bias_m_s2};
    place(first, rig.td_s, path.rate_B.front(), prior);
    return prior;
  }

  // From the state of the first picture to that of a sample before it.
  void place(core::State state, double td_s, const Eigen::Vector3d& rate_B, core::InitialPrior& prior) const {
    const std::size_t nearest = nearest_sample(log_.imu, td_s, origin_ns_);
    const double dt_s = core::to_seconds(log_.imu[nearest].t_ns - origin_ns_) - td_s;
    state.T_W_B.q = state.T_W_B.q * core::exp_quaternion(dt_s * rate_B);
    state.T_W_B.p += dt_s * state.v_W;
    const std::size_t lead = nearest_sample(log_.imu, td_s - kLeadS, origin_ns_);
    prior.t_ns = log_.imu[lead].t_ns;
    prior.start = carry(state, log_.imu, nearest, lead, log_.gravity_m_s2);
    set_mean(prior);
  }

  static void set_mean(core::InitialPrior& prior) {
    prior.mean = prior.start;
    prior.mean.bias = {};
  }

  FromScratch refine(const core::InitialPrior& aligned) const {
    Window window(log_, config_, aligned);
    for (const std::size_t frame : frames_) {
      if (!window.add_frame(frame)) throw NoStart("no IMU samples at a picture's time");
    }
    FromScratch result;
    result.found = true;
    result.prior = aligned;
    result.newest_frame = frames_.back();
    core::Initialisation& found = result.log.initialisation.emplace();
    found.aligned = window.states();
    const SettledWindow settled = settle(window, config_);
    if (settled.solution.result.status == core::SolveStatus::kDiverged || !settled.solution.covariance) {
      throw NoStart("the refined problem could not be solved");
    }
    const double misfit = settled.fit.squares_per_residual();
    const int inliers = settled.fit.visual.residuals / 2;
    if (misfit > config_.max_cost_per_dof || settled.outliers > inliers) {
      throw NoStart(
          fmt::format("the refined problem does not fit: mean squared residual {:.3g} of sigma^2, {} of {} "
                      "observations given up",
                      misfit, settled.outliers, settled.outliers + inliers));
    }
    const auto scale_sigma = window.relative_scale_sigma();
    if (!scale_sigma || *scale_sigma > config_.from_scratch.largest_scale_sigma) {
      throw NoStart(fmt::format("too little acceleration: the scale is known to {:.3g} of itself only",
                                scale_sigma.value_or(1.0)));
    }
    found.since_ns = log_.imu.front().t_ns;
    found.states = window.states();
    found.at_ns = found.states.back().t_ns;
    found.relative_scale_sigma = *scale_sigma;

    result.prior.start = unpack_state(window.oldest().x.data());
    result.prior.start_calibration = window.calibration();
    set_mean(result.prior);
    core::EstimateLog& log = result.log;
    log.status = core::SolveStatus::kConverged;
    log.states = found.states;
    log.calibration = window.calibration();
    log.td_estimated = config_.estimate.td;
    log.readout_estimated = config_.estimate.readout;
    log.extrinsics_estimated = config_.estimate.extrinsics;
    log.covariance = *settled.solution.covariance;
    log.summary.iterations = settled.iterations;
    log.summary.observations = settled.solution.observations;
    log.summary.visual = settled.fit.visual;
    return result;
  }

  const core::MeasurementLog& log_;
  const EstimatorConfig& config_;
  std::span<const std::size_t> frames_;
  BelievedNoise noise_;
  core::RigCalibration rig_;
  core::PinholeCamera camera_;
  core::TimeNs origin_ns_;
  std::vector<double> stamps_s_;  // of the pictures, after the first
};

}  // namespace

FromScratch initialise_from_scratch(const core::MeasurementLog& log, const EstimatorConfig& config) {
  const std::vector<std::size_t> keyframes = select_keyframes(log.frames, config.keyframe_rate_hz);
  std::string reason = "fewer keyframes than it takes";
  std::size_t oldest = 0;
  for (std::size_t newest = kLeastPictures - 1; newest < keyframes.size(); ++newest) {
    const auto stamp_ns = [&](std::size_t k) { return log.frames[keyframes[k]].t_cam_ns; };
    while (core::to_seconds(stamp_ns(newest) - stamp_ns(oldest)) > config.from_scratch.longest_s) ++oldest;
    if (newest - oldest + 1 < kLeastPictures) continue;
    try {
      return Attempt(log, config, std::span(keyframes).subspan(oldest, newest - oldest + 1)).run();
    } catch (const NoStart& no) {
      reason = no.what();
    } catch (const std::domain_error& error) {
      reason = error.what();
    }
  }
  FromScratch failed;
  failed.log.status = core::SolveStatus::kFailedInitialisation;
  failed.log.reason = "from scratch: " + reason;
  return failed;
}

}  // namespace plumbline::estimator
