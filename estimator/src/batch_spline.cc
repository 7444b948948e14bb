// The batch problem where the trajectory is a spline: its blocks and what it is fitted to.
#include <algorithm>
#include <cmath>
#include <utility>

#include "core/calibration.h"
#include "core/time.h"
#include "estimator/batch_problem.h"
#include "estimator/factors/spline_factors.h"

namespace plumbline::estimator {
namespace {

// Where rows are exposed at the present values.
SplineVisual::End exposure(const TrajectorySpline& spline, const core::RigCalibration& calibration, double t_cam_s,
                           double row_px, int rows) {
  const double t_s = t_cam_s + calibration.td_s + core::row_phase(row_px, rows) * calibration.readout_s;
  return {t_cam_s, spline.knots.segment(t_s)};
}

}  // namespace

// In the order of time, each control at the centre of its basis.
void BatchProblem::add_spline_blocks() {
  const SplineKnots& knots = spline_->knots;
  std::size_t bias = 0;
  const auto add_biases_before = [&](double t_s) {
    for (; bias < spline_->biases.size() && static_cast<double>(bias) * spline_->bias_interval_s < t_s; ++bias) {
      bias_blocks_.push_back(add_block({.values = spline_->biases[bias].data(), .size = kBiasSize, .dof = kBiasSize}));
    }
  };
  for (std::size_t i = 0; i < spline_->controls.size(); ++i) {
    add_biases_before((static_cast<double>(i) + 1.0 - 0.5 * knots.order) * knots.interval_s);
    control_blocks_.push_back(
        add_block({.values = spline_->controls[i].data(), .size = kPoseSize, .dof = 6, .manifold = &pose_manifold_}));
  }
  add_biases_before(2.0 * knots.end_s());
}

std::vector<int> BatchProblem::blocks_at(const SplineInstant& at) const {
  const auto first = control_blocks_.begin() + at.segment;
  std::vector<int> blocks(first, first + spline_->knots.order);
  const auto bias = bias_blocks_.begin() + at.bias;
  blocks.insert(blocks.end(), bias, bias + 2);
  return blocks;
}

BatchProblem::Term BatchProblem::spline_term(std::unique_ptr<SplineVisual> factor) const {
  std::vector<int> blocks;
  for (const int control : factor->controls()) blocks.push_back(control_blocks_[static_cast<std::size_t>(control)]);
  blocks.insert(blocks.end(), {extrinsics_block_, td_block_, readout_block_});
  return {std::move(factor), std::move(blocks)};
}

BatchProblem::Term BatchProblem::spline_point(const PointModel& model, const Timings& timings,
                                              const TrackObservation& anchor, const TrackObservation& observer) const {
  const auto end = [&](const TrackObservation& o) {
    return exposure(*spline_, start_.calibration, timings[o.keyframe].offset_s, o.pixel.y(),
                    model.camera.camera.height_px);
  };
  const SplineKnots& knots = spline_->knots;
  if (model.landmark == LandmarkType::kFixedBearing) {
    return spline_term(std::make_unique<SplinePoint<LandmarkType::kFixedBearing>>(
        model.camera, knots, end(anchor), end(observer), observer.pixel, anchor.pixel));
  }
  return spline_term(std::make_unique<SplinePoint<LandmarkType::kBearingInverseDepth>>(model.camera, knots, end(anchor),
                                                                                       end(observer), observer.pixel));
}

BatchProblem::Term BatchProblem::spline_line(const LineModel& model, const Timings& timings,
                                             const LineTrackObservation& o, const Eigen::Vector3d& origin_W) const {
  const auto end = [&](const Eigen::Vector2d& pixel) {
    return exposure(*spline_, start_.calibration, timings[o.keyframe].offset_s, pixel.y(),
                    model.camera.camera.height_px);
  };
  return spline_term(std::make_unique<SplineLine>(
      model.camera, spline_->knots, std::array{end(o.ends_px[0]), end(o.ends_px[1])}, origin_W, o.ends_px));
}

void BatchProblem::add_spline_inertial_factors() {
  const core::MeasurementLog& log = input_.log;
  const std::size_t samples = spline_->last_sample - spline_->first_sample;
  const double dt_s = spline_->knots.end_s() / static_cast<double>(samples);
  for (std::size_t i = spline_->first_sample; i <= spline_->last_sample; ++i) {
    const SplineInstant at = spline_->at(log, log.imu[i].t_ns);
    add_term({std::make_unique<SplineImu>(spline_->knots, at, log.imu[i], input_.noise.imu, dt_s, log.gravity_m_s2),
              blocks_at(at)},
             nullptr);
  }
  for (std::size_t i = 0; i + 1 < bias_blocks_.size(); ++i) {
    add_term({std::make_unique<BiasWalk>(input_.noise.imu, spline_->bias_interval_s),
              {bias_blocks_[i], bias_blocks_[i + 1]}},
             nullptr);
  }
}

core::State BatchProblem::state_on_spline(core::TimeNs t_ns) const {
  const SplineInstant at = spline_->at(input_.log, t_ns);
  std::vector<const double*> values;
  for (const int block : blocks_at(at)) values.push_back(problem_.blocks[static_cast<std::size_t>(block)].values);
  return spline_state(spline_->knots, at, values.data());
}

std::optional<core::KnotCheck> BatchProblem::knot_check() const {
  if (!spline_) return std::nullopt;
  using Channels = Eigen::Array<double, 6, 1>;
  Channels squares = Channels::Zero();
  const std::size_t samples = spline_->last_sample - spline_->first_sample + 1;
  for (std::size_t i = 0; i < samples; ++i) {
    Channels residuals;
    evaluate(problem_, problem_.terms[inertial_begin_ + i], residuals.data());
    squares += residuals.square();
  }
  const auto n = static_cast<double>(samples);
  return core::KnotCheck{.interval_s = spline_->knots.interval_s,
                         .excess_sigmas = (squares.maxCoeff() - n) / std::sqrt(2.0 * n)};
}

// d(state)/d(columns), those from the first that the state depends on to the calibration's.
Eigen::MatrixXd BatchProblem::newest_state_by_columns(const SchurSystem& system, int calibration) const {
  const core::TimeNs t_ns = input_.log.imu[start_.samples.back()].t_ns;
  const SplineInstant at = spline_->at(input_.log, t_ns);
  const std::vector<int> blocks = blocks_at(at);
  core::StateSigmas unit{1.0, 1.0, 1.0, 1.0, 1.0};
  const SplineState factor(spline_->knots, at, state_on_spline(t_ns), unit);
  std::vector<const double*> values;
  std::vector<std::vector<double>> ambient;
  std::vector<double*> jacobians;
  int first = system.columns();
  for (const int b : blocks) {
    const ParameterBlock& block = problem_.blocks[static_cast<std::size_t>(b)];
    values.push_back(block.values);
    ambient.emplace_back(static_cast<std::size_t>(core::kStateDof * block.size));
    first = std::min(first, system.column(b));
  }
  jacobians.reserve(ambient.size());
  for (std::vector<double>& J : ambient) jacobians.push_back(J.data());
  core::StateTangent residual;
  factor.Evaluate(values.data(), residual.data(), jacobians.data());
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  Eigen::MatrixXd J = Eigen::MatrixXd::Zero(core::kStateDof, system.columns() - calibration - first);
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    const ParameterBlock& block = problem_.blocks[static_cast<std::size_t>(blocks[i])];
    RowMajor on_tangent = Eigen::Map<const RowMajor>(ambient[i].data(), core::kStateDof, block.size);
    if (block.manifold != nullptr) {
      RowMajor tangent(core::kStateDof, block.dof);
      block.manifold->RightMultiplyByPlusJacobian(block.values, core::kStateDof, ambient[i].data(), tangent.data());
      on_tangent = tangent;
    }
    // The residual is the mean less the state.
    J.middleCols(system.column(blocks[i]) - first, block.dof) = -on_tangent;
  }
  return J;
}

}  // namespace plumbline::estimator
