#include "estimator/batch.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "estimator/batch_problem.h"
#include "estimator/batch_start.h"
#include "estimator/trajectory_spline.h"

namespace plumbline::estimator {
namespace {

// The states are timed anew when td has moved further than this from the td that placed them.
constexpr double kRetimeS = 5e-3;
// The biases' effect on a preintegrated rotation is linear to half the square of this [rad].
constexpr double kRelineariseRad = 1e-5;
constexpr double kFirstStageS = 2.0;

// What a solution must not leave: the biases that preintegration was linearised about, or on a spline the segments that
// the observations were put on, beyond which their polynomials go on with an error of this to the power of the degree.
bool left_linearisation(const BatchInput& input, const BatchValues& from, const BatchValues& to) {
  if (from.spline) {
    constexpr double kSegmentShare = 1e-2;
    const double moved_s = std::abs(to.calibration.td_s - from.calibration.td_s) +
                           0.5 * std::abs(to.calibration.readout_s - from.calibration.readout_s);
    return moved_s > kSegmentShare * from.spline->knots.interval_s;
  }
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

// A start for the first `keyframes` keyframes. Its landmarks are not kept: triangulated anew with better poses and more
// views, they leave a wrong minimum behind, and a line that is not determined does not run off.
void search(const BatchInput& input, std::size_t keyframes, BatchValues& values, double& timing_td_s) {
  place_states(input, keyframes, timing_td_s, values);
  triangulate_missing(input, values);
  BatchProblem problem(input, values, SolvePhase::kSearch);
  problem.solve();
  values = problem.values();
  values.forget_landmarks();
  if (must_retime(input, values.calibration.td_s, timing_td_s)) timing_td_s = values.calibration.td_s;
}

// Searches in stages, each twice as long as the one before.
void grow(const BatchInput& input, BatchValues& values, double& timing_td_s) {
  const core::TimeNs first_ns = input.log.frames[input.keyframes.front()].t_cam_ns;
  std::size_t count = 0;
  for (double end_s = kFirstStageS; count < input.keyframes.size(); end_s *= 2.0) {
    count =
        static_cast<std::size_t>(std::count_if(input.keyframes.begin(), input.keyframes.end(), [&](std::size_t frame) {
          return core::to_seconds(input.log.frames[frame].t_cam_ns - first_ns) <= end_s;
        }));
    search(input, count, values, timing_td_s);
  }
}

// Gives up the lines that a solution speaks against: wrong matches, and what the solver left behind a camera. False
// where there is none.
bool cull_lines(const BatchInput& input, const BatchProblem& problem, BatchValues& values) {
  std::vector<std::size_t> tracks = problem.lines_beyond(input.config.lines.cull_sigma);
  const std::vector<std::size_t> behind = lines_behind(input, values);
  tracks.insert(tracks.end(), behind.begin(), behind.end());
  for (const std::size_t track : tracks) {
    values.lines[track].reset();
    values.culled_lines[track] = true;
  }
  return !tracks.empty();
}

std::vector<core::LineEstimate> line_estimates(const BatchInput& input, const BatchValues& values) {
  std::vector<core::LineEstimate> lines;
  for (std::size_t t = 0; t < values.lines.size(); ++t) {
    const std::optional<LineValue>& line = values.lines[t];
    if (!line) continue;
    const PluckerLine L = OrthonormalLine(line->block.data()).plucker();
    const Eigen::Vector3d d = L.d.normalized();
    // From the line's own origin to the world's.
    lines.push_back({.track_id = input.line_tracks[t].id,
                     .moment_W = L.n / L.d.norm() + line->origin_W.cross(d),
                     .direction_W = d});
  }
  return lines;
}

core::EstimateLog failed(std::string reason) {
  core::EstimateLog log;
  log.status = core::SolveStatus::kFailedInitialisation;
  log.reason = std::move(reason);
  return log;
}

// Status, reason and covariance of the last solve.
void conclude(const BatchInput& input, BatchProblem& problem, bool too_coarse, core::EstimateLog& result) {
  if (result.summary.observations == 0) {
    result.status = core::SolveStatus::kFailedInitialisation;
    result.reason = "no observation could be used";
  } else if (too_coarse && result.knots) {
    result.status = core::SolveStatus::kKnotsTooCoarse;
    result.reason = fmt::format("knots {:.3g} s apart: the IMU's residuals exceed its noise by {:.3g} sigma",
                                result.knots->interval_s, result.knots->excess_sigmas);
  } else if (result.status == core::SolveStatus::kConverged && false_minimum(input, result.summary)) {
    result.status = core::SolveStatus::kFalseMinimum;
    result.reason = fmt::format("final cost {:.3g} per degree of freedom, above estimator.max_cost_per_dof = {}",
                                result.summary.cost_per_dof(), input.config.max_cost_per_dof);
  } else if (result.status != core::SolveStatus::kConverged) {
    result.reason =
        fmt::format("stopped after {} iterations at cost {:.6g}", result.summary.iterations, result.summary.final_cost);
  } else if (const auto covariance = problem.covariance()) {
    result.covariance = *covariance;
  } else {
    result.status = core::SolveStatus::kDiverged;
    result.reason = "the information at the solution is singular";
  }
}

core::EstimateLog grow_and_refine(const BatchInput& input) {
  const core::MeasurementLog& log = input.log;
  const EstimatorConfig& config = input.config;
  BatchValues values;
  values.calibration = log.prior.start_calibration;
  values.states = {log.prior.start};
  values.samples = {nearest_sample(log.imu, 0.0, log.prior.t_ns)};
  values.landmarks.resize(input.tracks.size());
  values.lines.resize(input.line_tracks.size());
  values.culled_lines.resize(input.line_tracks.size());
  double timing_td_s = config.state_td_s.value_or(log.prior.start_calibration.td_s);
  grow(input, values, timing_td_s);

  const bool on_spline = config.timing == TimingModel::kSpline;
  const std::optional<double>& given_s = config.spline.knot_spacing_s;
  double knot_interval_s = 0.0;
  if (on_spline) knot_interval_s = given_s ? *given_s : knot_interval_by_motion(input, values);

  // Refine until the solution stays where the factors were linearised.
  constexpr int kMaxRounds = 6;
  core::EstimateLog result;
  int iterations = 0;
  bool restarted = false;
  for (int round = 0; round < kMaxRounds; ++round) {
    place_states(input, input.keyframes.size(), timing_td_s, values);
    if (on_spline && !values.spline) values.spline = start_spline(input, values, knot_interval_s);
    triangulate_missing(input, values);
    BatchProblem problem(input, values);
    const BatchProblem::Outcome outcome = problem.solve();
    const BatchValues solved = problem.values();
    iterations += outcome.summary.iterations;
    result.status = outcome.status;
    result.summary = outcome.summary;
    result.knots = problem.knot_check();

    const bool too_coarse = outcome.status == core::SolveStatus::kConverged && result.knots &&
                            !(result.knots->excess_sigmas <= core::KnotCheck::kMostSigmas);
    if (too_coarse && !given_s && round + 1 < kMaxRounds) {
      knot_interval_s *= 0.5;
      values = solved;
      values.spline.reset();
      continue;
    }
    const bool bad =
        outcome.status != core::SolveStatus::kConverged || (!too_coarse && false_minimum(input, outcome.summary));
    if (bad && !restarted) {
      restarted = true;
      values = solved;
      values.spline.reset();
      values.forget_landmarks();
      search(input, input.keyframes.size(), values, timing_td_s);
      continue;
    }
    if (outcome.status == core::SolveStatus::kConverged && round + 1 < kMaxRounds) {
      BatchValues culled = solved;
      if (cull_lines(input, problem, culled)) {
        values = std::move(culled);
        continue;
      }
    }
    const bool retime = must_retime(input, solved.calibration.td_s, timing_td_s);
    if (!bad && (retime || left_linearisation(input, values, solved)) && round + 1 < kMaxRounds) {
      if (retime) timing_td_s = solved.calibration.td_s;
      values = solved;
      continue;
    }

    values = solved;
    conclude(input, problem, too_coarse, result);
    break;
  }

  result.summary.iterations = iterations;
  result.calibration = values.calibration;
  result.td_estimated = config.estimate.td;
  result.readout_estimated = config.estimate.readout;
  result.extrinsics_estimated = config.estimate.extrinsics;
  result.lines = line_estimates(input, values);
  result.line_tracks = static_cast<int>(input.line_tracks.size());
  for (std::size_t i = 0; i < values.states.size(); ++i) {
    result.states.push_back({log.imu[values.samples[i]].t_ns, values.states[i]});
  }
  return result;
}

}  // namespace

core::EstimateLog estimate_batch(const core::MeasurementLog& log, const EstimatorConfig& config) {
  BatchInput input{.log = log,
                   .config = config,
                   .noise = believed_noise(config, log.imu_noise, log.pixel_sigma_px, log.line_sigma_px),
                   .keyframes = {},
                   .tracks = {}};
  input.keyframes = select_keyframes(log.frames, config.keyframe_rate_hz);
  if (uses_points(config.use)) input.tracks = collect_tracks(log.frames, input.keyframes, log.camera);
  if (uses_lines(config.use)) input.line_tracks = collect_line_tracks(log.frames, input.keyframes, log.camera);
  if (config.timing == TimingModel::kFeatureVelocity) {
    const int dropped = drop_without_velocity(input.tracks) + drop_without_velocity(input.line_tracks);
    if (dropped > 0 && input.tracks.empty() && input.line_tracks.empty()) {
      return failed("no track has the image velocities that estimator.timing = feature_velocity needs");
    }
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
