#include "estimator/factors/spline_factors.h"

#include <cmath>
#include <cstdlib>
#include <numeric>
#include <stdexcept>

#include "estimator/factors/parameter_blocks.h"

namespace plumbline::estimator {
namespace {

// The blocks of a segment's controls and of the biases at both ends of an instant.
void add_segment_blocks(const SplineKnots& knots, std::vector<std::int32_t>& sizes) {
  sizes.assign(static_cast<std::size_t>(knots.order), kPoseSize);
  sizes.insert(sizes.end(), {kBiasSize, kBiasSize});
}

template <int kRows>
void write_control(const Eigen::Matrix<double, kRows, 6>& J, const double* control, double* out) {
  Eigen::Map<Eigen::Matrix<double, kRows, kPoseSize, Eigen::RowMajor>> ambient(out);
  ambient.template leftCols<3>() = J.template leftCols<3>();
  ambient.template rightCols<4>().noalias() =
      J.template rightCols<3>() *
      core::minus_jacobian(Eigen::Quaterniond(Eigen::Map<const Eigen::Quaterniond>(control + 3)));
}

template <int kRows>
void write_segment(const SplinePath& path, int order, const SplinePath::BodyRows<kRows>& rows,
                   double const* const* parameters, double** jacobians) {
  const auto J = path.chain_to_controls<kRows>(rows);
  for (int j = 0; j < order; ++j) {
    if (jacobians[j] != nullptr) write_control<kRows>(J[static_cast<std::size_t>(j)], parameters[j], jacobians[j]);
  }
}

BiasBlock bias_at(const SplineInstant& at, double const* const* biases) {
  return (1.0 - at.bias_share) * Eigen::Map<const BiasBlock>(biases[0]) +
         at.bias_share * Eigen::Map<const BiasBlock>(biases[1]);
}

// J: with respect to the bias at the instant.
template <int kRows>
void write_biases(const SplineInstant& at, const Eigen::Matrix<double, kRows, kBiasSize>& J, double** jacobians) {
  using Ambient = Eigen::Map<Eigen::Matrix<double, kRows, kBiasSize, Eigen::RowMajor>>;
  if (jacobians[0] != nullptr) Ambient{jacobians[0]} = (1.0 - at.bias_share) * J;
  if (jacobians[1] != nullptr) Ambient{jacobians[1]} = at.bias_share * J;
}

}  // namespace

SegmentPair::SegmentPair(const SplineKnots& knots, const std::array<int, 2>& of) : segments(of), order(knots.order) {
  const int apart = std::min(std::abs(of[1] - of[0]), order);
  from = {of[0] <= of[1] ? 0 : apart, of[0] <= of[1] ? apart : 0};
  size = apart + order;
}

std::vector<int> SegmentPair::controls() const {
  std::vector<int> result(static_cast<std::size_t>(size));
  for (std::size_t k = 0; k < 2; ++k)
    std::iota(result.begin() + from[k], result.begin() + from[k] + order, segments[k]);
  return result;
}

SplineVisual::SplineVisual(const SplineKnots& knots, const std::array<End, 2>& ends, int landmark_size)
    : knots_(knots), ends_(ends), pair_(knots, {ends[0].segment, ends[1].segment}) {
  set_num_residuals(2);
  std::vector<std::int32_t>& sizes = *mutable_parameter_block_sizes();
  sizes.assign(static_cast<std::size_t>(pair_.size), kPoseSize);
  sizes.insert(sizes.end(), {kPoseSize, 1, 1, landmark_size});
}

bool SplineVisual::wants_controls(double** jacobians) const {
  return std::any_of(jacobians, jacobians + pair_.size, [](const double* J) { return J != nullptr; });
}

void SplineVisual::write_controls(const std::array<SplinePath::ControlRows<2>, 2>& rows,
                                  double const* const* parameters, double** jacobians) const {
  for (int c = 0; c < pair_.size; ++c) {
    if (jacobians[c] == nullptr) continue;
    Eigen::Matrix<double, 2, 6> J = Eigen::Matrix<double, 2, 6>::Zero();
    for (std::size_t k = 0; k < 2; ++k) {
      const int j = c - pair_.from[k];
      if (j >= 0 && j < pair_.order) J += rows[k][static_cast<std::size_t>(j)];
    }
    write_control<2>(J, parameters[c], jacobians[c]);
  }
}

template <LandmarkType kLandmark>
bool SplinePoint<kLandmark>::Evaluate(double const* const* parameters, double* residuals, double** jacobians) const {
  const TimedRig rig(parameters + pair_.size);
  SplinePath anchor = path(parameters, 0);
  SplinePath observer = path(parameters, 1);
  Eigen::Vector2d r;
  TimedPointJacobians J;
  if (!law_.see(rig, parameters[pair_.size + 3], anchor, ends_[0].t_cam_s, observer, ends_[1].t_cam_s, r,
                jacobians != nullptr ? &J : nullptr)) {
    return false;
  }
  Eigen::Map<Eigen::Vector2d>{residuals} = r;
  if (jacobians == nullptr) return true;
  if (wants_controls(jacobians)) {
    write_controls({anchor.chain_to_controls<2>({.position = J.anchor_position, .theta = J.anchor_rotation}),
                    observer.chain_to_controls<2>({.position = J.observer_position, .theta = J.observer_rotation})},
                   parameters, jacobians);
  }
  law_.write_shared(J, rig, jacobians + pair_.size);
  return true;
}

template class SplinePoint<LandmarkType::kBearingInverseDepth>;
template class SplinePoint<LandmarkType::kFixedBearing>;

bool SplineLine::Evaluate(double const* const* parameters, double* residuals, double** jacobians) const {
  const TimedRig rig(parameters + pair_.size);
  const OrthonormalLine line(parameters[pair_.size + 3]);
  if (line.degenerate()) return false;
  const LineRows rows(jacobians);
  const bool with_controls = rows.any() && wants_controls(jacobians);
  std::array<SplinePath::ControlRows<2>, 2> of_controls;
  for (std::size_t k = 0; k < 2; ++k) {
    SplinePath at = path(parameters, k);
    TimedEnd seen;
    if (!law_.see(k, rig, line, at, ends_[k].t_cam_s, seen)) return false;
    residuals[k] = seen.residual;
    if (with_controls) {
      SplinePath::BodyRows<2> body;
      body.position.row(static_cast<int>(k)) = seen.body_position;
      body.theta.row(static_cast<int>(k)) = seen.body_rotation;
      of_controls[k] = at.chain_to_controls<2>(body);
    }
    law_.write_shared(seen, rig, line, rows, pair_.size, static_cast<int>(k));
  }
  if (with_controls) write_controls(of_controls, parameters, jacobians);
  return true;
}

SplineImu::SplineImu(const SplineKnots& knots, const SplineInstant& at, const core::ImuSample& sample,
                     const core::ImuNoise& noise, double dt_s, double gravity_m_s2)
    : knots_(knots),
      at_(at),
      sample_(sample),
      gyro_weight_(std::sqrt(dt_s) / noise.gyro_noise_density),
      accel_weight_(std::sqrt(dt_s) / noise.accel_noise_density),
      gravity_W_(0.0, 0.0, -gravity_m_s2) {
  set_num_residuals(6);
  add_segment_blocks(knots, *mutable_parameter_block_sizes());
}

bool SplineImu::Evaluate(double const* const* parameters, double* residuals, double** jacobians) const {
  double const* const* biases = parameters + knots_.order;
  SplinePath path(knots_, at_.segment, parameters);
  TimedBody body;
  if (!path.at(at_.t_s, body)) return false;
  const BiasBlock bias = bias_at(at_, biases);
  const Eigen::Vector3d force = body.R.transpose() * (path.acceleration() - gravity_W_);
  Eigen::Map<Eigen::Vector3d>{residuals} = gyro_weight_ * (body.omega + bias.head<3>() - sample_.gyro_rad_s);
  Eigen::Map<Eigen::Vector3d>{residuals + 3} = accel_weight_ * (force + bias.tail<3>() - sample_.accel_m_s2);
  if (jacobians == nullptr) return true;
  SplinePath::BodyRows<6> rows;
  rows.omega.topRows<3>().diagonal().setConstant(gyro_weight_);
  rows.theta.bottomRows<3>() = accel_weight_ * core::skew(force);
  rows.acceleration.bottomRows<3>() = accel_weight_ * body.R.transpose();
  write_segment<6>(path, knots_.order, rows, parameters, jacobians);
  BiasBlock weights;
  weights << Eigen::Vector3d::Constant(gyro_weight_), Eigen::Vector3d::Constant(accel_weight_);
  write_biases<6>(at_, weights.asDiagonal().toDenseMatrix(), jacobians + knots_.order);
  return true;
}

core::State spline_state(const SplineKnots& knots, const SplineInstant& at, double const* const* blocks) {
  SplinePath path(knots, at.segment, blocks);
  TimedBody body;
  if (!path.at(at.t_s, body)) throw std::logic_error("spline_state: an instant outside of its segment");
  const BiasBlock bias = bias_at(at, blocks + knots.order);
  return {.T_W_B = {Eigen::Quaterniond(body.R).normalized(), body.p},
          .v_W = body.velocity,
          .bias = {bias.head<3>(), bias.tail<3>()}};
}

SplineState::SplineState(const SplineKnots& knots, const SplineInstant& at, const core::State& mean,
                         const core::StateSigmas& sigma)
    : knots_(knots), at_(at), prior_(mean, sigma) {
  set_num_residuals(core::kStateDof);
  add_segment_blocks(knots, *mutable_parameter_block_sizes());
}

bool SplineState::Evaluate(double const* const* parameters, double* residuals, double** jacobians) const {
  constexpr int kDof = core::kStateDof;
  const core::State state = spline_state(knots_, at_, parameters);
  const StateBlock block = pack(state);
  const double* const x = block.data();
  Eigen::Matrix<double, kDof, kStateSize, Eigen::RowMajor> ambient;
  double* J_state = ambient.data();
  if (!prior_.Evaluate(&x, residuals, jacobians != nullptr ? &J_state : nullptr)) return false;
  if (jacobians == nullptr) return true;
  SplinePath path(knots_, at_.segment, parameters);
  TimedBody body;
  if (!path.at(at_.t_s, body)) return false;
  write_segment<kDof>(path, knots_.order,
                      {.position = ambient.leftCols<3>(),
                       .theta = ambient.middleCols<4>(3) * core::plus_jacobian(state.T_W_B.q),
                       .velocity = ambient.middleCols<3>(7)},
                      parameters, jacobians);
  write_biases<kDof>(at_, ambient.rightCols<kBiasSize>(), jacobians + knots_.order);
  return true;
}

BiasWalk::BiasWalk(const core::ImuNoise& noise, double interval_s) {
  weights_ << Eigen::Vector3d::Constant(1.0 / (noise.gyro_bias_walk * std::sqrt(interval_s))),
      Eigen::Vector3d::Constant(1.0 / (noise.accel_bias_walk * std::sqrt(interval_s)));
}

bool BiasWalk::Evaluate(double const* const* parameters, double* residuals, double** jacobians) const {
  const Eigen::Map<const BiasBlock> from(parameters[0]);
  const Eigen::Map<const BiasBlock> to(parameters[1]);
  Eigen::Map<BiasBlock>{residuals} = weights_.cwiseProduct(to - from);
  if (jacobians == nullptr) return true;
  using Square = Eigen::Map<Eigen::Matrix<double, kBiasSize, kBiasSize, Eigen::RowMajor>>;
  if (jacobians[0] != nullptr) Square{jacobians[0]} = Eigen::MatrixXd((-weights_).asDiagonal());
  if (jacobians[1] != nullptr) Square{jacobians[1]} = Eigen::MatrixXd(weights_.asDiagonal());
  return true;
}

}  // namespace plumbline::estimator
