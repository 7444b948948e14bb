#include "estimator/sliding_window.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "estimator/window.h"
#include "estimator/window_settle.h"

namespace plumbline::estimator {
namespace {

// Named causes of failure.
struct Failure {
  core::SolveStatus status;
  std::string reason;
};

class OnlineEstimate {
 public:
  OnlineEstimate(const core::MeasurementLog& log, const EstimatorConfig& config, std::size_t first_frame)
      : log_(log), config_(config), first_frame_(first_frame) {
    window_.emplace(log, config);
    if (config.window.restarts > 0) result_.restarts = 0;
    result_.td_estimated = config.estimate.td;
    result_.readout_estimated = config.estimate.readout;
    result_.extrinsics_estimated = config.estimate.extrinsics;
  }

  std::optional<Failure> run() {
    for (const std::size_t frame : select_keyframes(log_.frames, config_.keyframe_rate_hz)) {
      if (!newest_stays_) window_->drop_newest();
      newest_stays_ = true;
      const std::optional<Failure> failure = advance(frame);
      if (failure && !begin_anew()) return failure;
    }
    if (result_.state_history.empty()) {
      return Failure{core::SolveStatus::kFailedInitialisation, "no keyframe could be used"};
    }
    result_.status = core::SolveStatus::kConverged;
    result_.calibration = window_->calibration();
    result_.covariance = covariance_;
    return std::nullopt;
  }

  core::EstimateLog take() { return std::move(result_); }

 private:
  std::optional<Failure> advance(std::size_t frame) {
    try {
      if (!window_->add_frame(frame) || frame < first_frame_) return std::nullopt;
      return step();
    } catch (const std::domain_error& error) {
      return Failure{core::SolveStatus::kDiverged, error.what()};
    }
  }

  // From the last state that fitted; false where there is none, or no restart is left.
  bool begin_anew() {
    if (!sound_ || result_.restarts.value_or(0) >= config_.window.restarts) return false;
    ++*result_.restarts;
    window_.emplace(log_, config_, *sound_);
    unsolved_ = misfits_ = rejections_ = 0;
    return true;
  }

  // The newest state and the calibration as a prior: the state as uncertain as it is or as the initial one was,
  // whichever is more, the calibration as uncertain as at first.
  core::InitialPrior as_prior(core::TimeNs t_ns) const {
    core::InitialPrior prior = log_.prior;
    prior.t_ns = t_ns;
    prior.mean = prior.start = unpack_state(window_->newest().x.data());
    prior.calibration = prior.start_calibration = window_->calibration();
    const auto widen = [&](double& sigma, int first) {
      const auto variances = covariance_.diagonal().segment<3>(core::kCovLastState + first);
      sigma = std::max(sigma, std::sqrt(variances.maxCoeff()));
    };
    widen(prior.sigma.position_m, core::kPosition);
    widen(prior.sigma.orientation_rad, core::kOrientation);
    widen(prior.sigma.velocity_m_s, core::kVelocity);
    widen(prior.sigma.gyro_bias_rad_s, core::kGyroBias);
    widen(prior.sigma.accel_bias_m_s2, core::kAccelBias);
    return prior;
  }

  std::optional<Failure> step() {
    const core::TimeNs t_ns = log_.imu[window_->newest().sample].t_ns;
    const SettledWindow settled = settle(*window_, config_);
    result_.summary.iterations += settled.iterations;
    const WindowSolution& solution = settled.solution;
    if (solution.result.status == core::SolveStatus::kDiverged || !solution.covariance) {
      return Failure{core::SolveStatus::kDiverged,
                     fmt::format("the window of the keyframe at {} ns could not be solved", t_ns)};
    }
    if (auto failure = watch(t_ns, settled)) return failure;
    summarise(solution, settled.fit);
    covariance_ = *solution.covariance;
    record(t_ns);
    if (unsolved_ == 0 && misfits_ == 0 && rejections_ == 0) sound_ = as_prior(t_ns);
    newest_stays_ =
        window_->size() < 3 || !(window_->parallax_of_newest_px().value_or(1e9) < config_.window.keyframe_parallax_px);
    if (!newest_stays_) return std::nullopt;
    const bool td_is_known =
        !config_.estimate.td || std::sqrt(covariance_(core::kCovTd, core::kCovTd)) < config_.window.freeze_td_sigma_s;
    const int most = window_->folded() || (td_is_known && scale_is_known()) ? config_.window.keyframes
                                                                            : config_.window.start_keyframes;
    while (window_->size() > static_cast<std::size_t>(std::max(most, config_.window.keyframes))) window_->fold_oldest();
    return std::nullopt;
  }

  // What leaves is linearised for good, so that a scale that is a few percent off would stay so. The prior tells it,
  // but where the estimate began from scratch.
  bool scale_is_known() {
    constexpr double kKnown = 0.01;
    return first_frame_ == 0 || window_->relative_scale_sigma().value_or(1.0) < kKnown;
  }

  // Once is an accident, so many keyframes in a row are not.
  static constexpr int kPatience = 10;

  // What an estimate that has gone astray shows.
  std::optional<Failure> watch(core::TimeNs t_ns, const SettledWindow& settled) {
    const auto count = [](int& in_a_row, bool bad) { in_a_row = bad ? in_a_row + 1 : 0; };
    const double squares_per_residual = settled.fit.squares_per_residual();
    count(unsolved_, settled.solution.result.status == core::SolveStatus::kIterationLimit);
    count(misfits_, squares_per_residual > config_.max_cost_per_dof);
    count(rejections_, 2 * settled.outliers > window_->observations_of_newest());
    const std::string since = fmt::format("of {} keyframes in a row up to {} ns", kPatience, t_ns);
    if (unsolved_ >= kPatience && window_->folded()) {
      return Failure{
          core::SolveStatus::kIterationLimit,
          fmt::format("the windows {} took more than estimator.max_iterations = {}", since, config_.max_iterations)};
    }
    if (misfits_ >= kPatience) {
      return Failure{core::SolveStatus::kFalseMinimum,
                     fmt::format("mean squared residual {:.3g} of sigma^2 in the windows {}, above "
                                 "estimator.max_cost_per_dof = {}",
                                 squares_per_residual, since, config_.max_cost_per_dof)};
    }
    if (rejections_ >= kPatience) {
      return Failure{core::SolveStatus::kFalseMinimum,
                     fmt::format("more than half as many observations as fit do not fit the windows {}", since)};
    }
    return std::nullopt;
  }

  void summarise(const WindowSolution& solution, const WindowFit& fit) {
    core::SolveSummary& summary = result_.summary;
    summary.initial_cost = solution.result.initial_cost;
    summary.final_cost = solution.result.final_cost;
    summary.observations = solution.observations;
    summary.visual = fit.visual;
  }

  void record(core::TimeNs t_ns) {
    const core::State state = unpack_state(window_->newest().x.data());
    const auto P = covariance_.block<core::kStateDof, core::kStateDof>(core::kCovLastState, core::kCovLastState);
    // Frames that an earlier td put later than this one now lies.
    const auto later = [&](const auto& entry) { return entry.t_ns >= t_ns; };
    std::erase_if(result_.states, later);
    std::erase_if(result_.state_history, later);
    std::erase_if(result_.td_history, later);
    result_.states.push_back({t_ns, state});
    result_.state_history.push_back({t_ns, state, P});
    if (config_.estimate.td) {
      result_.td_history.push_back(
          {t_ns, window_->calibration().td_s, std::sqrt(covariance_(core::kCovTd, core::kCovTd))});
    }
  }

  const core::MeasurementLog& log_;
  const EstimatorConfig& config_;
  std::size_t first_frame_;
  std::optional<Window> window_;
  std::optional<core::InitialPrior> sound_;  // the last state that fitted
  bool newest_stays_ = true;
  int unsolved_ = 0;  // keyframes in a row
  int misfits_ = 0;
  int rejections_ = 0;
  core::PosteriorCovariance covariance_ = core::PosteriorCovariance::Zero();
  core::EstimateLog result_;
};

}  // namespace

core::EstimateLog estimate_in_window(const core::MeasurementLog& log, const EstimatorConfig& config,
                                     std::size_t first_frame) {
  OnlineEstimate online(log, config, first_frame);
  const std::optional<Failure> failure = online.run();
  core::EstimateLog result = online.take();
  if (failure) {
    result.status = failure->status;
    result.reason = failure->reason;
  }
  return result;
}

}  // namespace plumbline::estimator
