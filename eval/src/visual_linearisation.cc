#include "visual_linearisation.h"

#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <stdexcept>

#include <Eigen/Eigenvalues>

#include "estimator/factors/line_factors.h"
#include "estimator/factors/world_point.h"

namespace plumbline::eval {
namespace {

using estimator::kLineDof;
using estimator::kLineSize;
using estimator::kPoseSize;
using estimator::kStateSize;

// Scaled so that the information on them is the identity.
template <int kDof>
Eigen::MatrixXd observed_directions(const Eigen::Matrix<double, kDof, kDof>& information) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, kDof, kDof>> eigen(information);
  // Rounding leaves about 1e-15 of the largest eigenvalue where there is no parallax at all.
  const double least = 1e-12 * eigen.eigenvalues()(kDof - 1);
  int first = 0;
  while (eigen.eigenvalues()(first) < least) ++first;
  return eigen.eigenvectors().rightCols(kDof - first) *
         eigen.eigenvalues().tail(kDof - first).cwiseSqrt().cwiseInverse().asDiagonal();
}

// Observations of landmarks of one kind, as they come.
template <int kDof>
class Tracks {
 public:
  explicit Tracks(VisualLinearisation& result) : result_(result), first_(result.tracks.size()) {}

  void add(std::size_t frame, std::int64_t track_id, VisualObservation observation) {
    const auto [entry, is_new] = index_.try_emplace(track_id, static_cast<int>(result_.tracks.size()));
    if (is_new) {
      result_.tracks.emplace_back();
      sums_.emplace_back();
    }
    observation.track = entry->second;
    result_.tracks[static_cast<std::size_t>(entry->second)].last_frame = frame;
    Sum& sum = sums_[static_cast<std::size_t>(entry->second) - first_];
    const Jacobian J = observation.landmark;
    sum.information += J.transpose() * J;
    ++sum.observations;
    result_.frames[frame].push_back(std::move(observation));
  }

  // Once all are in: the landmarks' columns on the directions that are observed.
  void reduce() {
    std::vector<Eigen::MatrixXd> bases;
    for (std::size_t t = 0; t < sums_.size(); ++t) {
      bases.push_back(2 * sums_[t].observations > kDof ? observed_directions<kDof>(sums_[t].information)
                                                       : Eigen::MatrixXd());
      result_.tracks[first_ + t].dof = static_cast<int>(bases.back().cols());
    }
    for (auto& frame : result_.frames) {
      for (VisualObservation& o : frame) {
        const std::size_t track = static_cast<std::size_t>(o.track);
        if (track < first_ || result_.tracks[track].dof == 0) continue;
        const Jacobian J = o.landmark;
        o.landmark = J * bases[track - first_];
      }
    }
  }

 private:
  using Jacobian = Eigen::Matrix<double, 2, kDof>;
  struct Sum {
    Eigen::Matrix<double, kDof, kDof> information = Eigen::Matrix<double, kDof, kDof>::Zero();  // all else known
    int observations = 0;
  };

  VisualLinearisation& result_;
  std::size_t first_;  // track of this kind
  std::map<std::int64_t, int> index_;
  std::vector<Sum> sums_;
};

// What is made for each frame once.
std::vector<estimator::FrameTiming> frame_timings(const core::MeasurementLog& log, const core::RigCalibration& rig,
                                                  const BoundOptions& options, const TrueMotion& motion) {
  // The gap from a state to a row is at most half a readout and half an IMU interval.
  const double reach_s = 0.5 * std::abs(rig.readout_s) + 0.05;
  std::vector<estimator::FrameTiming> timings;
  for (std::size_t k = 0; k < options.frames.size(); ++k) {
    const std::size_t sample = motion.samples[k + 1];
    timings.push_back({std::make_shared<estimator::LocalMotion>(motion.imu, sample, reach_s, motion.states[k + 1].bias),
                       core::to_seconds(log.frames[options.frames[k]].t_cam_ns - log.imu[sample].t_ns)});
  }
  return timings;
}

// The Jacobian on the tangent spaces of a row-major one on the ambient spaces.
template <int kAmbient, int kTangent>
Eigen::Matrix<double, 2, kTangent> on_tangent(const Eigen::Matrix<double, 2, kAmbient, Eigen::RowMajor>& J,
                                              const ceres::Manifold& manifold, const double* x) {
  Eigen::Matrix<double, kAmbient, kTangent, Eigen::RowMajor> plus;
  manifold.PlusJacobian(x, plus.data());
  return J * plus;
}

// A segment's observation as the factor has it, at the truth.
class TrueLine {
 public:
  TrueLine(const estimator::CameraModel& model, const core::RigCalibration& rig)
      : model_(model), extrinsics_(estimator::pack(rig.T_B_C)), td_s_(rig.td_s), readout_s_(rig.readout_s) {}

  struct Seen {
    VisualObservation observation;
    double mean_gap_s;
  };
  // Nothing where the line is not seen as one.
  std::optional<Seen> observe(const estimator::FrameTiming& timing, const core::State& state,
                              const Eigen::Vector3d& origin_W, const estimator::LineBlock& line,
                              const estimator::SegmentPixels& measured_px) const {
    const estimator::StateBlock x = estimator::pack(state);
    const std::array<const double*, 5> parameters = {x.data(), extrinsics_.data(), &td_s_, &readout_s_, line.data()};
    const auto ends_px = estimator::PropagatedLineFactor(model_, timing, origin_W, measured_px).feet(parameters.data());
    if (!ends_px || !on_rays(*ends_px)) return std::nullopt;
    const estimator::PropagatedLineFactor factor(model_, timing, origin_W, *ends_px);
    Eigen::Matrix<double, 2, kStateSize, Eigen::RowMajor> J_state;
    Eigen::Matrix<double, 2, kPoseSize, Eigen::RowMajor> J_extrinsics;
    Eigen::Vector2d J_td;
    Eigen::Vector2d J_readout;
    Eigen::Matrix<double, 2, kLineSize, Eigen::RowMajor> J_line;
    Eigen::Vector2d residual;
    std::array<double*, 5> jacobians = {J_state.data(), J_extrinsics.data(), J_td.data(), J_readout.data(),
                                        J_line.data()};
    if (!factor.Evaluate(parameters.data(), residual.data(), jacobians.data())) return std::nullopt;
    Seen seen;
    VisualObservation& o = seen.observation;
    o.state = on_tangent<kStateSize, core::kStateDof>(J_state, estimator::StateManifold(), x.data());
    o.calibration << on_tangent<kPoseSize, 6>(J_extrinsics, estimator::PoseManifold(), extrinsics_.data()), J_td,
        J_readout, Eigen::Matrix<double, 2, estimator::kIntrinsicsSize>::Zero();  // held where there are lines
    o.landmark = on_tangent<kLineSize, kLineDof>(J_line, estimator::OrthonormalLineManifold(), line.data());
    const auto gap_s = [&](const Eigen::Vector2d& pixel) {
      const double phase = core::row_phase(pixel.y(), model_.camera.height_px);
      return std::abs(timing.offset_s + td_s_ + phase * readout_s_);
    };
    seen.mean_gap_s = 0.5 * (gap_s((*ends_px)[0]) + gap_s((*ends_px)[1]));
    return seen;
  }

 private:
  bool on_rays(const estimator::SegmentPixels& ends_px) const {
    return model_.camera.try_unproject(ends_px[0]) && model_.camera.try_unproject(ends_px[1]);
  }

  const estimator::CameraModel& model_;
  estimator::PoseBlock extrinsics_;
  double td_s_;
  double readout_s_;
};

class Lineariser {
 public:
  Lineariser(const core::MeasurementLog& log, const sim::GroundTruth& truth, const BoundOptions& options,
             const TrueMotion& motion)
      : log_(log),
        truth_(truth),
        options_(options),
        motion_(motion),
        timings_(frame_timings(log, truth.calibration, options, motion)) {
    result_.frames.resize(options.frames.size());
  }

  VisualLinearisation linearise() {
    if (options_.points) add_points();
    if (options_.lines) add_lines();
    return std::move(result_);
  }

 private:
  const core::Frame& frame(std::size_t k) const { return log_.frames[options_.frames[k]]; }

  void add_points() {
    const estimator::CameraModel model{truth_.calibration.camera(log_.camera), log_.pixel_sigma_px, log_.gravity_m_s2};
    Tracks<3> tracks(result_);
    for (std::size_t k = 0; k < timings_.size(); ++k) {
      for (const core::PointObservation& point : frame(k).points) {
        const auto landmark = truth_.track_landmark.find(point.track_id);
        if (landmark == truth_.track_landmark.end()) continue;  // a false track has no truth
        const Eigen::Vector3d& P_W = truth_.landmarks_W[static_cast<std::size_t>(landmark->second)];
        estimator::WorldPointJacobians J;
        const auto seen = estimator::observe_world_point(model, timings_[k], motion_.states[k + 1], truth_.calibration,
                                                         P_W, point.pixel.y(), &J);
        if (!seen) continue;
        VisualObservation observation{.state = J.state, .calibration = {}, .landmark = J.point};
        observation.calibration << J.extrinsics, J.td, J.readout, J.intrinsics;
        tracks.add(k, point.track_id, std::move(observation));
        result_.point_gaps.sum_s += std::abs(seen->tau_s);
        ++result_.point_gaps.observations;
      }
    }
    tracks.reduce();
  }

  // The true line of a track about the origin of its first observation.
  struct LineAtTruth {
    Eigen::Vector3d origin_W;
    std::optional<estimator::LineBlock> block;
  };
  LineAtTruth line_of(const sim::Segment& segment, std::size_t k) const {
    const Eigen::Vector3d origin_W = motion_.states[k + 1].T_W_B * truth_.calibration.T_B_C.p;
    return {origin_W, estimator::orthonormal_line(
                          estimator::line_through(segment.ends_W[0] - origin_W, segment.ends_W[1] - origin_W))};
  }

  void add_lines() {
    const estimator::CameraModel model{truth_.calibration.camera(log_.camera), log_.line_sigma_px, log_.gravity_m_s2};
    const TrueLine view(model, truth_.calibration);
    Tracks<kLineDof> tracks(result_);
    std::map<std::int64_t, LineAtTruth> lines;
    for (std::size_t k = 0; k < timings_.size(); ++k) {
      for (const core::LineObservation& o : frame(k).lines) {
        if (!(log_.line_sigma_px > 0.0)) throw std::domain_error("the bound of lines needs line_sigma_px > 0");
        if (options_.intrinsics) throw std::domain_error("the bound of lines needs known intrinsics");
        const auto segment = truth_.track_segment.find(o.track_id);
        if (segment == truth_.track_segment.end()) continue;
        const auto index = static_cast<std::size_t>(segment->second);
        const LineAtTruth& line = lines.try_emplace(o.track_id, line_of(truth_.segments_W[index], k)).first->second;
        if (!line.block) continue;
        auto seen = view.observe(timings_[k], motion_.states[k + 1], line.origin_W, *line.block, o.ends_px);
        if (!seen) continue;
        tracks.add(k, o.track_id, std::move(seen->observation));
        result_.line_gaps.sum_s += seen->mean_gap_s;
        ++result_.line_gaps.observations;
      }
    }
    tracks.reduce();
  }

  const core::MeasurementLog& log_;
  const sim::GroundTruth& truth_;
  const BoundOptions& options_;
  const TrueMotion& motion_;
  std::vector<estimator::FrameTiming> timings_;
  VisualLinearisation result_;
};

}  // namespace

VisualLinearisation linearise_visual(const core::MeasurementLog& log, const sim::GroundTruth& truth,
                                     const BoundOptions& options, const TrueMotion& motion) {
  return Lineariser(log, truth, options, motion).linearise();
}

}  // namespace plumbline::eval
