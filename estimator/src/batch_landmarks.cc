// The visual half of the batch problem: points, then lines.
#include <algorithm>
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
  if (spline_) {
    for (const std::size_t frame : input_.keyframes) {
      timings.push_back({nullptr, spline_->seconds(input_.log, input_.log.frames[frame].t_cam_ns)});
    }
    return timings;
  }
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
bool BatchProblem::add_landmark(ParameterBlock landmark, std::vector<Term> terms) {
  landmark.eliminated = true;
  const int block = add_block(landmark);
  for (Term& term : terms) {
    term.blocks.push_back(block);
    Eigen::Vector2d residual;
    ResidualTerm candidate{.factor = term.factor.get(), .count = static_cast<int>(term.blocks.size())};
    std::copy(term.blocks.begin(), term.blocks.end(), candidate.blocks.begin());
    if (!evaluate(problem_, candidate, residual.data())) {
      problem_.blocks.pop_back();
      return false;
    }
  }
  for (Term& term : terms) add_term(std::move(term), loss_.get());
  observations_ += static_cast<int>(terms.size());
  return true;
}

bool BatchProblem::add_point(const PointModel& model, const Timings& timings, const Track& track,
                             Eigen::Vector3d& landmark) {
  const auto view = [&](const TrackObservation& o) -> PointView { return {timings[o.keyframe], o.pixel, o.velocity}; };
  const TrackObservation& first = track.observations.front();
  const PointView anchor = view(first);
  std::vector<Term> terms;
  if (auto factor = make_anchor_factor(model, anchor)) {
    std::vector<int> blocks;
    if (model.timing == TimingModel::kFeatureVelocity) blocks = {td_block_, readout_block_};
    terms.push_back({std::move(factor), std::move(blocks)});
  }
  const std::size_t of_anchor = terms.size();
  for (auto o = track.observations.begin() + 1; o != track.observations.end() && o->keyframe < timings.size(); ++o) {
    if (spline_) {
      terms.push_back(spline_point(model, timings, first, *o));
      continue;
    }
    terms.push_back(
        {make_point_factor(model, anchor, view(*o)),
         {state_block(first.keyframe), state_block(o->keyframe), extrinsics_block_, td_block_, readout_block_}});
  }
  if (terms.size() == of_anchor) return false;
  const bool fixed = model.landmark == LandmarkType::kFixedBearing;
  const int size = fixed ? 1 : kLandmarkSize;
  return add_landmark({.values = fixed ? &landmark.z() : landmark.data(), .size = size, .dof = size}, std::move(terms));
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

// Nor is a line added that has two views: their four rows are spent on its four degrees of freedom and say nothing of
// the motion, but the solver would follow them to infinity.
bool BatchProblem::add_line(const LineModel& model, const Timings& timings, std::size_t track, LineValue& line) {
  constexpr std::size_t kLeastViews = 3;
  std::vector<Term> terms;
  for (const LineTrackObservation& o : input_.line_tracks[track].observations) {
    if (o.keyframe >= timings.size()) break;
    if (spline_) {
      terms.push_back(spline_line(model, timings, o, line.origin_W));
      continue;
    }
    terms.push_back({make_line_factor(model, {timings[o.keyframe], o.ends_px, o.velocities}, line.origin_W),
                     {state_block(o.keyframe), extrinsics_block_, td_block_, readout_block_}});
  }
  return terms.size() >= kLeastViews &&
         add_landmark({.values = line.block.data(), .size = kLineSize, .dof = kLineDof, .manifold = &line_manifold_},
                      std::move(terms));
}

std::vector<std::size_t> BatchProblem::lines_beyond(double sigmas) const {
  std::vector<std::size_t> tracks;
  for (std::size_t t = line_begin_; t < inertial_begin_; ++t) {
    const ResidualTerm& term = problem_.terms[t];
    const std::size_t line = static_cast<std::size_t>(eliminated_block(problem_, term) - first_line_block_);
    if (!tracks.empty() && tracks.back() == line_tracks_[line]) continue;
    Eigen::Vector2d residual;
    const bool known = evaluate(problem_, term, residual.data());
    if (!known || !(residual.cwiseAbs().maxCoeff() <= sigmas)) tracks.push_back(line_tracks_[line]);
  }
  return tracks;
}

}  // namespace plumbline::estimator
