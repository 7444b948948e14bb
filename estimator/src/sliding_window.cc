#include "estimator/sliding_window.h"

#include <cmath>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "estimator/window.h"

namespace plumbline::estimator {
namespace {

// The states are timed anew when td has moved further than this from the td that placed them.
constexpr double kRetimeS = 5e-3;

// Named causes of failure.
struct Failure {
  core::SolveStatus status;
  std::string reason;
};

class OnlineEstimate {
 public:
  OnlineEstimate(const core::MeasurementLog& log, const EstimatorConfig& config)
      : log_(log), config_(config), window_(log, config) {
    result_.td_estimated = config.estimate.td;
    result_.readout_estimated = config.estimate.readout;
    result_.extrinsics_estimated = config.estimate.extrinsics;
  }

  std::optional<Failure> run() {
    for (const std::size_t frame : select_keyframes(log_.frames, config_.keyframe_rate_hz)) {
      if (!window_.add_frame(frame)) continue;
      if (auto failure = step()) return failure;
    }
    if (result_.state_history.empty()) {
      return Failure{core::SolveStatus::kFailedInitialisation, "no keyframe could be used"};
    }
    result_.status = core::SolveStatus::kConverged;
    result_.calibration = window_.calibration();
    result_.covariance = covariance_;
    return std::nullopt;
  }

  core::EstimateLog take() { return std::move(result_); }

 private:
  std::optional<Failure> step() {
    const core::TimeNs t_ns = log_.imu[window_.newest().sample].t_ns;
    window_.triangulate();
    std::optional<WindowSolution> solution;
    WindowFit fit;
    int outliers = 0;
    constexpr int kMaxRounds = 4;
    for (int round = 0; round < kMaxRounds; ++round) {
      solution = window_.solve();
      result_.summary.iterations += solution->result.iterations;
      if (solution->result.status == core::SolveStatus::kDiverged) break;
      if (must_retime()) {
        window_.retime(window_.calibration().td_s);
        continue;
      }
      fit = window_.assess(round + 1 < kMaxRounds);
      outliers += fit.outliers;
      if (fit.outliers == 0) break;
    }
    if (solution->result.status == core::SolveStatus::kDiverged || !solution->covariance) {
      return Failure{core::SolveStatus::kDiverged,
                     fmt::format("the window of the keyframe at {} ns could not be solved", t_ns)};
    }
    covariance_ = *solution->covariance;
    record(t_ns);
    const core::TimeNs first_ns = result_.state_history.front().t_ns;
    const bool settled = !config_.estimate.td ||
                         std::sqrt(covariance_(core::kCovTd, core::kCovTd)) < config_.window.freeze_td_sigma_s ||
                         core::to_seconds(t_ns - first_ns) > config_.window.longest_start_s;
    if (settled || window_.folded()) {
      while (window_.size() > static_cast<std::size_t>(config_.window.keyframes)) window_.fold_oldest();
    }
    return std::nullopt;
  }

  bool must_retime() const {
    return !window_.folded() && !config_.state_td_s &&
           std::abs(window_.calibration().td_s - window_.timing_td_s()) > kRetimeS;
  }

  void record(core::TimeNs t_ns) {
    const core::State state = unpack_state(window_.newest().x.data());
    const auto P = covariance_.bottomRightCorner<core::kStateDof, core::kStateDof>();
    result_.states.push_back({t_ns, state});
    result_.state_history.push_back({t_ns, state, P});
    if (config_.estimate.td) {
      result_.td_history.push_back(
          {t_ns, window_.calibration().td_s, std::sqrt(covariance_(core::kCovTd, core::kCovTd))});
    }
  }

  const core::MeasurementLog& log_;
  const EstimatorConfig& config_;
  Window window_;
  core::PosteriorCovariance covariance_ = core::PosteriorCovariance::Zero();
  core::EstimateLog result_;
};

}  // namespace

core::EstimateLog estimate_in_window(const core::MeasurementLog& log, const EstimatorConfig& config) {
  OnlineEstimate online(log, config);
  const std::optional<Failure> failure = online.run();
  core::EstimateLog result = online.take();
  if (failure) {
    result.status = failure->status;
    result.reason = failure->reason;
  }
  return result;
}

}  // namespace plumbline::estimator
