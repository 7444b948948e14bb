#include "estimator/batch.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <fmt/format.h>

#include "estimator/batch_problem.h"
#include "estimator/factors/imu_increment.h"
#include "estimator/triangulation.h"

namespace plumbline::estimator {
namespace {

// The states are timed anew when td has moved further than this from the td that placed them.
constexpr double kRetimeS = 5e-3;
// The biases' effect on a preintegrated rotation is linear to half the square of this [rad].
constexpr double kRelineariseRad = 1e-5;
constexpr double kFirstStageS = 2.0;

std::size_t nearest_sample(const std::vector<core::ImuSample>& imu, double t_s, core::TimeNs origin_ns) {
  const auto time = [&](const core::ImuSample& s) { return core::to_seconds(s.t_ns - origin_ns); };
  const auto after =
      std::lower_bound(imu.begin(), imu.end(), t_s, [&](const core::ImuSample& s, double t) { return time(s) < t; });
  if (after == imu.begin()) return 0;
  if (after == imu.end()) return imu.size() - 1;
  const bool earlier = t_s - time(*(after - 1)) <= time(*after) - t_s;
  return static_cast<std::size_t>(after - imu.begin()) - (earlier ? 1 : 0);
}

// No estimate where there is no starting point; what() is the reason.
class NoStart : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// Puts the states of the first `keyframes` keyframes at the samples nearest to t_cam + td, carried there by the IMU:
// those that exist from where they were, new ones from the one before. Between two states there must be motion.
void place_states(const BatchInput& input, std::size_t keyframes, double td_s, BatchValues& values) {
  const std::vector<core::ImuSample>& imu = input.log.imu;
  for (std::size_t k = 0; k < keyframes; ++k) {
    const core::TimeNs t_cam_ns = input.log.frames[input.keyframes[k]].t_cam_ns;
    const std::size_t sample = nearest_sample(imu, td_s, t_cam_ns);
    if (sample <= values.samples[k]) {
      throw NoStart(fmt::format(
          "keyframe {}, stamped {} ns: with td = {:.6g} s no IMU sample is left for its state after that at {} ns", k,
          t_cam_ns, td_s, imu[values.samples[k]].t_ns));
    }
    const std::size_t i = k + 1;
    if (i == values.states.size()) {
      values.states.push_back(carry(values.states[k], imu, values.samples[k], sample, input.log.gravity_m_s2));
      values.samples.push_back(sample);
    } else if (sample != values.samples[i]) {
      values.states[i] = carry(values.states[i], imu, values.samples[i], sample, input.log.gravity_m_s2);
      values.samples[i] = sample;
    }
  }
}

// Gives a value to each landmark without one that two of the placed keyframes have seen.
void triangulate_missing(const BatchInput& input, BatchValues& values) {
  const core::PinholeCamera& camera = input.log.camera;
  const std::size_t placed = values.states.size() - 1;
  const auto camera_pose = [&](const TrackObservation& o) -> core::Pose {
    const core::State& state = values.states[o.keyframe + 1];
    const std::size_t sample = values.samples[o.keyframe + 1];
    const core::TimeNs t_cam_ns = input.log.frames[input.keyframes[o.keyframe]].t_cam_ns;
    const double tau_s = core::to_seconds(t_cam_ns - input.log.imu[sample].t_ns) + values.calibration.td_s +
                         core::row_phase(o.pixel.y(), camera.height_px) * values.calibration.readout_s;
    // Constant rate over the few milliseconds from the state: good enough to start from.
    const Eigen::Vector3d rate = input.log.imu[sample].gyro_rad_s - state.bias.gyro_rad_s;
    const core::Pose T_W_B{state.T_W_B.q * core::exp_quaternion(rate * tau_s), state.T_W_B.p + tau_s * state.v_W};
    return T_W_B * values.calibration.T_B_C;
  };
  for (std::size_t t = 0; t < input.tracks.size(); ++t) {
    if (values.landmarks[t]) continue;
    std::vector<View> views;
    for (const TrackObservation& o : input.tracks[t].observations) {
      if (o.keyframe < placed) views.push_back({camera_pose(o), o.pixel});
    }
    if (views.size() >= 2) values.landmarks[t] = triangulate(camera, views);
  }
}

bool biases_left_linearisation(const BatchInput& input, const BatchValues& from, const BatchValues& to) {
  for (std::size_t i = 0; i + 1 < to.states.size(); ++i) {
    const double dt = core::to_seconds(input.log.imu[to.samples[i + 1]].t_ns - input.log.imu[to.samples[i]].t_ns);
    const double moved = (to.states[i].bias.gyro_rad_s - from.states[i].bias.gyro_rad_s).norm();
    if (moved * dt > kRelineariseRad) return true;
  }
  return false;
}

bool must_retime(const BatchInput& input, double td_s, double timing_td_s) {
  return !input.config.state_td_s && std::abs(td_s - timing_td_s) > kRetimeS;
}

bool false_minimum(const BatchInput& input, const core::SolveSummary& summary) {
  return summary.cost_per_dof() > input.config.max_cost_per_dof;
}

// Solves the recording loosely in stages, each twice as long as the one before.
void grow(const BatchInput& input, BatchValues& values, double& timing_td_s) {
  const core::TimeNs first_ns = input.log.frames[input.keyframes.front()].t_cam_ns;
  const auto keyframes_until = [&](double end_s) {
    return static_cast<std::size_t>(std::count_if(
        input.keyframes.begin(), input.keyframes.end(),
        [&](std::size_t frame) { return core::to_seconds(input.log.frames[frame].t_cam_ns - first_ns) <= end_s; }));
  };
  for (double end_s = kFirstStageS;; end_s *= 2.0) {
    const std::size_t count = keyframes_until(end_s);
    place_states(input, count, timing_td_s, values);
    triangulate_missing(input, values);

    BatchProblem problem(input, values);
    const BatchProblem::SolveOptions loose{.max_iterations = 20, .function_tolerance = 0.05};
    const BatchProblem::Outcome outcome = problem.solve(loose);
    values = problem.values();
    // Landmarks that were triangulated from poor poses may have caught the solver; the poses are better now.
    if (false_minimum(input, outcome.summary)) {
      std::fill(values.landmarks.begin(), values.landmarks.end(), std::nullopt);
    }
    if (must_retime(input, values.calibration.td_s, timing_td_s)) timing_td_s = values.calibration.td_s;
    if (count == input.keyframes.size()) return;
  }
}

core::EstimateLog failed(std::string reason) {
  core::EstimateLog log;
  log.status = core::SolveStatus::kFailedInitialisation;
  log.reason = std::move(reason);
  return log;
}

core::EstimateLog grow_and_refine(const BatchInput& input) {
  const core::MeasurementLog& log = input.log;
  const EstimatorConfig& config = input.config;
  BatchValues values;
  values.calibration = log.prior.start_calibration;
  values.states = {log.prior.start};
  values.samples = {nearest_sample(log.imu, 0.0, log.prior.t_ns)};
  values.landmarks.resize(input.tracks.size());
  double timing_td_s = config.state_td_s.value_or(log.prior.start_calibration.td_s);
  grow(input, values, timing_td_s);

  // Refine until biases and td stay where the factors were linearised.
  constexpr int kMaxRounds = 6;
  core::EstimateLog result;
  int iterations = 0;
  bool restarted = false;
  for (int round = 0; round < kMaxRounds; ++round) {
    place_states(input, input.keyframes.size(), timing_td_s, values);
    triangulate_missing(input, values);
    BatchProblem problem(input, values);
    BatchProblem::SolveOptions options{.max_iterations = config.max_iterations};
    if (restarted) options.initial_trust_region_radius = 1e4;
    const BatchProblem::Outcome outcome = problem.solve(options);
    const BatchValues solved = problem.values();
    iterations += outcome.summary.iterations;
    result.status = outcome.status;
    result.summary = outcome.summary;

    const bool bad = outcome.status != core::SolveStatus::kConverged || false_minimum(input, outcome.summary);
    if (bad && !restarted) {
      // Once more with all landmarks triangulated anew and strong damping.
      restarted = true;
      values = solved;
      std::fill(values.landmarks.begin(), values.landmarks.end(), std::nullopt);
      continue;
    }
    const bool retime = must_retime(input, solved.calibration.td_s, timing_td_s);
    if (!bad && (retime || biases_left_linearisation(input, values, solved)) && round + 1 < kMaxRounds) {
      if (retime) timing_td_s = solved.calibration.td_s;
      values = solved;
      continue;
    }

    values = solved;
    if (outcome.summary.observations == 0) {
      result.status = core::SolveStatus::kFailedInitialisation;
      result.reason = "no observation could be used";
    } else if (result.status == core::SolveStatus::kConverged && false_minimum(input, outcome.summary)) {
      result.status = core::SolveStatus::kFalseMinimum;
      result.reason = fmt::format("final cost {:.3g} per degree of freedom, above estimator.max_cost_per_dof = {}",
                                  outcome.summary.cost_per_dof(), config.max_cost_per_dof);
    } else if (result.status != core::SolveStatus::kConverged) {
      result.reason = fmt::format("Ceres stopped after {} iterations at cost {:.6g}", outcome.summary.iterations,
                                  outcome.summary.final_cost);
    } else if (const auto covariance = problem.posterior_covariance()) {
      result.covariance = *covariance;
    } else {
      result.status = core::SolveStatus::kDiverged;
      result.reason = "the information at the solution is singular";
    }
    break;
  }

  result.summary.iterations = iterations;
  result.calibration = values.calibration;
  result.td_estimated = config.estimate.td;
  result.readout_estimated = config.estimate.readout;
  result.extrinsics_estimated = config.estimate.extrinsics;
  for (std::size_t i = 0; i < values.states.size(); ++i) {
    result.states.push_back({log.imu[values.samples[i]].t_ns, values.states[i]});
  }
  return result;
}

}  // namespace

core::EstimateLog estimate_batch(const core::MeasurementLog& log, const EstimatorConfig& config) {
  BatchInput input{.log = log,
                   .config = config,
                   .noise = believed_noise(config, log.imu_noise, log.pixel_sigma_px),
                   .keyframes = {},
                   .tracks = {}};
  input.keyframes = select_keyframes(log.frames, config.keyframe_rate_hz);
  input.tracks = collect_tracks(log.frames, input.keyframes, log.camera);
  if (config.timing == TimingModel::kFeatureVelocity && drop_without_velocity(input.tracks) > 0 &&
      input.tracks.empty()) {
    return failed("no track has the image velocities that estimator.timing = feature_velocity needs");
  }
  if (input.keyframes.size() < 2) return failed("fewer than two keyframes");
  if (log.imu.size() < 2 || log.imu.front().t_ns > log.prior.t_ns) return failed("no IMU samples at the prior's time");
  try {
    return grow_and_refine(input);
  } catch (const NoStart& reason) {
    return failed(reason.what());
  }
}

}  // namespace plumbline::estimator
