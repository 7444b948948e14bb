// The visual half of the batch problem: points, then lines.
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "estimator/batch_problem.h"
#include "estimator/factors/local_motion.h"

namespace plumbline::estimator {

BatchProblem::Timings BatchProblem::frame_timings() const {
  // How far observations may move from their states: what lies between them now, half the readout, and td and readout
  // five sigma off.
  const core::CalibrationSigmas& sigma = input_.log.prior.calibration_sigma;
  const double sample_s = core::to_seconds(input_.log.imu[1].t_ns - input_.log.imu[0].t_ns);
  const double margin_s = 0.5 * std::abs(readout_s_) + sample_s + 5.0 * (sigma.td_s + sigma.readout_s);
  Timings timings;
  for (std::size_t k = 0; k + 1 < states_.size(); ++k) {
    const std::size_t sample = start_.samples[k + 1];
    const core::TimeNs t_cam_ns = input_.log.frames[input_.keyframes[k]].t_cam_ns;
    const double offset_s = core::to_seconds(t_cam_ns - input_.log.imu[sample].t_ns);
    const double reach_s = margin_s + std::abs(offset_s + td_s_);
    timings.push_back(
        {std::make_shared<LocalMotion>(input_.log.imu, sample, reach_s, start_.states[k + 1].bias), offset_s});
  }
  return timings;
}

void BatchProblem::add_points(const Timings& timings) {
  const EstimatorConfig& config = input_.config;
  const PointModel model{.camera = {.camera = input_.log.camera,
                                    .pixel_sigma_px = input_.noise.pixel_sigma_px,
                                    .gravity_m_s2 = input_.log.gravity_m_s2,
                                    .residual = config.residual},
                         .timing = config.timing,
                         .landmark = config.landmark};
  landmarks_.reserve(input_.tracks.size());  // parameter blocks must not move
  for (std::size_t t = 0; t < input_.tracks.size(); ++t) {
    const std::optional<Eigen::Vector3d>& start = start_.landmarks[t];
    if (!start) continue;
    Eigen::Vector3d& landmark = landmarks_.emplace_back(*start);
    if (add_point(model, timings, input_.tracks[t], landmark)) {
      landmark_tracks_.push_back(t);
    } else {
      landmarks_.pop_back();
    }
  }
}

// False, and nothing added, where a factor cannot be evaluated.
bool BatchProblem::add_point(const PointModel& model, const Timings& timings, const Track& track,
                             Eigen::Vector3d& landmark) {
  const auto view = [&](const TrackObservation& o) -> PointView { return {timings[o.keyframe], o.pixel, o.velocity}; };
  const TrackObservation& first = track.observations.front();
  const PointView anchor = view(first);
  double* const landmark_values = landmark_block(landmark);
  const auto blocks = [&](std::size_t keyframe) -> std::vector<double*> {
    return {states_[first.keyframe + 1].data(),
            states_[keyframe + 1].data(),
            extrinsics_.data(),
            &td_s_,
            &readout_s_,
            landmark_values};
  };

  std::vector<std::pair<std::unique_ptr<ceres::CostFunction>, std::size_t>> factors;
  for (auto o = track.observations.begin() + 1; o != track.observations.end() && o->keyframe < timings.size(); ++o) {
    auto factor = make_point_factor(model, anchor, view(*o));
    Eigen::Vector2d residual;
    if (!factor->Evaluate(blocks(o->keyframe).data(), residual.data(), nullptr)) return false;
    factors.emplace_back(std::move(factor), o->keyframe);
  }
  if (factors.empty()) return false;
  if (auto term = make_anchor_term(model, anchor, &td_s_, &readout_s_, landmark_values)) {
    problem_->AddResidualBlock(term->factor.release(), loss_.get(), term->blocks);
    ++observations_;
  }
  observations_ += static_cast<int>(factors.size());
  for (auto& [factor, keyframe] : factors) {
    problem_->AddResidualBlock(factor.release(), loss_.get(), blocks(keyframe));
  }
  return true;
}

double* BatchProblem::landmark_block(Eigen::Vector3d& landmark) const {
  return input_.config.landmark == LandmarkType::kFixedBearing ? &landmark.z() : landmark.data();
}

void BatchProblem::add_lines(const Timings& timings) {
  const LineModel model{.camera = {.camera = input_.log.camera,
                                   .pixel_sigma_px = input_.noise.line_sigma_px,
                                   .gravity_m_s2 = input_.log.gravity_m_s2},
                        .timing = input_.config.timing};
  lines_.reserve(input_.line_tracks.size());  // parameter blocks must not move
  for (std::size_t t = 0; t < input_.line_tracks.size(); ++t) {
    const std::optional<LineValue>& start = start_.lines[t];
    if (!start) continue;
    LineValue& line = lines_.emplace_back(*start);
    if (add_line(model, timings, t, line)) {
      line_tracks_.push_back(t);
    } else {
      lines_.pop_back();
    }
  }
}

// False, and nothing added, where a factor cannot be evaluated, or where the line has two views: their four rows are
// spent on its four degrees of freedom and say nothing of the motion, but the solver would follow them to infinity.
bool BatchProblem::add_line(const LineModel& model, const Timings& timings, std::size_t track, LineValue& line) {
  constexpr std::size_t kLeastViews = 3;
  const auto blocks = [&](std::size_t keyframe) -> std::vector<double*> {
    return {states_[keyframe + 1].data(), extrinsics_.data(), &td_s_, &readout_s_, line.block.data()};
  };
  std::vector<std::pair<std::unique_ptr<ceres::CostFunction>, std::size_t>> factors;
  for (const LineTrackObservation& o : input_.line_tracks[track].observations) {
    if (o.keyframe >= timings.size()) break;
    auto factor = make_line_factor(model, {timings[o.keyframe], o.ends_px, o.velocities}, line.origin_W);
    Eigen::Vector2d residual;
    if (!factor->Evaluate(blocks(o.keyframe).data(), residual.data(), nullptr)) return false;
    factors.emplace_back(std::move(factor), o.keyframe);
  }
  if (factors.size() < kLeastViews) return false;
  problem_->AddParameterBlock(line.block.data(), kLineSize, &line_manifold_);
  for (auto& [factor, keyframe] : factors) {
    const auto id = problem_->AddResidualBlock(factor.release(), loss_.get(), blocks(keyframe));
    line_residuals_.push_back({track, id});
  }
  observations_ += static_cast<int>(factors.size());
  return true;
}

std::vector<std::size_t> BatchProblem::lines_beyond(double sigmas) const {
  std::vector<std::size_t> tracks;
  for (const auto& [track, block] : line_residuals_) {
    if (!tracks.empty() && tracks.back() == track) continue;
    Eigen::Vector2d residual;
    const bool known = problem_->EvaluateResidualBlock(block, false, nullptr, residual.data(), nullptr);
    if (!known || !(residual.cwiseAbs().maxCoeff() <= sigmas)) tracks.push_back(track);
  }
  return tracks;
}

}  // namespace plumbline::estimator
