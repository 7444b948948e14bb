#include "eval/cramer_rao.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

#include "estimator/factors/imu_factor.h"
#include "eval/information_chain.h"
#include "visual_linearisation.h"

namespace plumbline::eval {
namespace {

using core::kStateDof;
using Variable = InformationChain::Variable;
using StateVector = Eigen::Matrix<double, kStateDof, 1>;
constexpr int kFirstIntrinsics = 8;  // of the calibration

// Units in which the information of every block is of the same order, so that sums and differences keep their digits.
StateVector state_units() {
  StateVector u;
  u << Eigen::Vector3d::Constant(1e-2), Eigen::Vector3d::Constant(1e-3), Eigen::Vector3d::Constant(1e-2),
      Eigen::Vector3d::Constant(1e-4), Eigen::Vector3d::Constant(1e-2);
  return u;
}
Eigen::Matrix<double, kCalibrationDof, 1> calibration_units() {
  Eigen::Matrix<double, kCalibrationDof, 1> u;
  u << Eigen::Vector3d::Constant(1e-3), Eigen::Vector3d::Constant(1e-3), 1e-4, 1e-4, core::Intrinsics::Ones();
  return u;
}

class Builder {
 public:
  Builder(const core::MeasurementLog& log, const sim::GroundTruth& truth, const BoundOptions& options)
      : log_(log), truth_(truth), options_(options), imu_(noise_free_imu(log, truth)) {
    const auto free = [&](bool is_free, int first, int count) {
      for (int i = 0; is_free && i < count; ++i) free_.push_back(first + i);
    };
    free(options.extrinsics, 0, 6);
    free(options.td, 6, 1);
    free(options.readout, 7, 1);
    free(options.intrinsics, kFirstIntrinsics, estimator::kIntrinsicsSize);
    place_states();
    visual_ = linearise_visual(log_, truth_, options_, {imu_, samples_, true_states_});
    landmarks_.assign(visual_.tracks.size(), -1);
  }

  CramerRaoBound build() {
    add_priors();
    for (std::size_t k = 0; k < options_.frames.size(); ++k) add_frame(k);
    chain_.finish();
    bound_.causal = std::move(causal_);
    read_covariances();
    add_aligned_errors();
    add_kappa2();
    return bound_;
  }

 private:
  // State 0 at the prior's stamp, state k + 1 at the IMU sample nearest to the middle row of frame k. Samples are those
  // of the log: the truth also has the ones that dropped out.
  void place_states() {
    const auto nearest = [&](core::TimeNs t_ns) {
      const auto after = std::lower_bound(log_.imu.begin(), log_.imu.end(), t_ns,
                                          [](const core::ImuSample& s, core::TimeNs t) { return s.t_ns < t; });
      if (after == log_.imu.begin()) return std::size_t{0};
      const auto i = static_cast<std::size_t>(after - log_.imu.begin());
      if (after == log_.imu.end() || t_ns - (after - 1)->t_ns <= after->t_ns - t_ns) return i - 1;
      return i;
    };
    samples_.push_back(nearest(log_.prior.t_ns));
    for (const std::size_t frame : options_.frames) {
      samples_.push_back(nearest(log_.frames[frame].t_cam_ns + core::to_ns(truth_.calibration.td_s)));
      if (samples_.back() <= samples_[samples_.size() - 2]) {
        throw std::domain_error("two states of the bound fall on one IMU sample");
      }
    }
    for (const std::size_t sample : samples_) true_states_.push_back(sim::state_at(truth_, log_.imu[sample].t_ns));
  }

  const core::State& state(std::size_t i) const { return true_states_[i]; }
  core::TimeNs stamp(std::size_t i) const { return log_.imu[samples_[i]].t_ns; }

  void add_priors() {
    states_.push_back(chain_.add(kStateDof));
    const StateVector sigma = log_.prior.sigma.per_axis();
    chain_.observe({states_[0]}, state_units().cwiseQuotient(sigma).asDiagonal());
    if (free_.empty()) return;
    calibration_ = chain_.add(static_cast<int>(free_.size()));
    const core::CalibrationSigmas& s = log_.prior.calibration_sigma;
    Eigen::Matrix<double, kCalibrationDof, 1> sigmas;
    sigmas << Eigen::Vector3d::Constant(s.extrinsic_position_m), Eigen::Vector3d::Constant(s.extrinsic_rotation_rad),
        s.td_s, s.readout_s, s.focal_px, s.focal_px, s.principal_point_px, s.principal_point_px;
    chain_.observe({calibration_}, calibration_units().cwiseQuotient(sigmas)(free_).asDiagonal());
  }

  void add_inertial(std::size_t i) {
    const std::span<const core::ImuSample> all(imu_);
    const auto samples = all.subspan(samples_[i], samples_[i + 1] - samples_[i] + 1);
    const estimator::ImuFactor factor(estimator::preintegrate(samples, state(i).bias, log_.imu_noise),
                                      log_.gravity_m_s2);
    const std::array<estimator::StateBlock, 2> blocks = {estimator::pack(state(i)), estimator::pack(state(i + 1))};
    using Ambient = Eigen::Matrix<double, kStateDof, estimator::kStateSize, Eigen::RowMajor>;
    std::array<Ambient, 2> ambient;
    StateVector residual;
    const std::array<const double*, 2> parameters = {blocks[0].data(), blocks[1].data()};
    std::array<double*, 2> jacobians = {ambient[0].data(), ambient[1].data()};
    factor.Evaluate(parameters.data(), residual.data(), jacobians.data());
    Eigen::MatrixXd J(kStateDof, 2 * kStateDof);
    for (std::size_t b = 0; b < 2; ++b) {
      Eigen::Matrix<double, estimator::kStateSize, kStateDof, Eigen::RowMajor> plus;
      estimator::StateManifold().PlusJacobian(blocks[b].data(), plus.data());
      J.middleCols(static_cast<Eigen::Index>(b) * kStateDof, kStateDof) =
          ambient[b] * plus * state_units().asDiagonal();
    }
    chain_.observe({states_[i], states_[i + 1]}, J);
  }

  void add_observation(std::size_t k, const VisualObservation& observation) {
    VisualTrack& track = visual_.tracks[static_cast<std::size_t>(observation.track)];
    if (track.dof == 0) return;
    Variable& variable = landmarks_[static_cast<std::size_t>(observation.track)];
    if (variable < 0) {
      variable = chain_.add(track.dof);
      alive_.push_back(observation.track);
    }
    const auto n_free = static_cast<Eigen::Index>(free_.size());
    Eigen::MatrixXd J(2, kStateDof + n_free + track.dof);
    J.leftCols(kStateDof) = observation.state * state_units().asDiagonal();
    J.middleCols(kStateDof, n_free) = (observation.calibration * calibration_units().asDiagonal())(Eigen::all, free_);
    J.rightCols(track.dof) = observation.landmark;
    std::vector<Variable> variables = {states_[k + 1]};
    if (n_free > 0) variables.push_back(calibration_);
    variables.push_back(variable);
    chain_.observe(variables, J);
  }

  void add_frame(std::size_t k) {
    states_.push_back(chain_.add(kStateDof));
    add_inertial(k);
    for (const VisualObservation& observation : visual_.frames[k]) add_observation(k, observation);
    if (options_.causal) add_causal(k);

    std::vector<Variable> done = {states_[k]};
    std::erase_if(alive_, [&](int t) {
      if (visual_.tracks[static_cast<std::size_t>(t)].last_frame != k) return false;
      done.push_back(landmarks_[static_cast<std::size_t>(t)]);
      return true;
    });
    chain_.eliminate(done);
  }

  // Rows of `covariance` that stand for the free calibration and a state, and their units.
  struct Layout {
    std::vector<int> rows;
    Eigen::VectorXd units;
  };
  Layout layout() const {
    Layout l{.rows = free_, .units = Eigen::VectorXd(static_cast<Eigen::Index>(free_.size()) + kStateDof)};
    for (int& row : l.rows) row += row < kFirstIntrinsics ? 0 : core::kCovIntrinsics - kFirstIntrinsics;
    for (int i = 0; i < kStateDof; ++i) l.rows.push_back(core::kCovLastState + i);
    for (std::size_t i = 0; i < free_.size(); ++i) {
      l.units[static_cast<Eigen::Index>(i)] = calibration_units()[free_[i]];
    }
    l.units.tail<kStateDof>() = state_units();
    return l;
  }
  std::vector<Variable> calibration_and(Variable state) const {
    return free_.empty() ? std::vector<Variable>{state} : std::vector<Variable>{calibration_, state};
  }

  void add_causal(std::size_t k) {
    std::vector<Variable> weak;
    weak.reserve(alive_.size());
    for (const int t : alive_) weak.push_back(landmarks_[static_cast<std::size_t>(t)]);
    const Layout l = layout();
    const Eigen::MatrixXd scaled = chain_.causal_covariance(calibration_and(states_[k + 1]), weak);
    CausalBound causal{.t_ns = stamp(k + 1)};
    causal.covariance(l.rows, l.rows) = l.units.asDiagonal() * scaled * l.units.asDiagonal();
    causal_.push_back(std::move(causal));
  }

  void read_covariances() {
    marginals_ = chain_.marginals();
    const Eigen::Matrix<double, 6, 1> units = state_units().head<6>();
    for (std::size_t i = 0; i < states_.size(); ++i) {
      bound_.t_ns.push_back(stamp(i));
      const Eigen::MatrixXd& Sigma = marginals_[static_cast<std::size_t>(states_[i])];
      bound_.poses.push_back(units.asDiagonal() * Sigma.topLeftCorner<6, 6>() * units.asDiagonal());
    }
    const Layout l = layout();
    Eigen::MatrixXd selected = Eigen::MatrixXd::Zero(chain_.total_dof(), l.units.size());
    std::vector<int> rows;
    for (const Variable v : calibration_and(states_.back())) {
      for (int i = 0; i < chain_.dof(v); ++i) rows.push_back(chain_.offset(v) + i);
    }
    for (std::size_t i = 0; i < rows.size(); ++i) selected(rows[i], static_cast<Eigen::Index>(i)) = 1.0;
    const Eigen::MatrixXd Sigma = chain_.solve(selected)(rows, Eigen::all);
    bound_.covariance(l.rows, l.rows) =
        l.units.asDiagonal() * (0.5 * (Sigma + Sigma.transpose())) * l.units.asDiagonal();
  }

  void add_aligned_errors() {
    std::vector<core::Pose> poses;
    std::vector<ScaledPose> rows;
    const StateVector units = state_units();
    for (std::size_t i = 0; i < states_.size(); ++i) {
      poses.push_back(state(i).T_W_B);
      const int first = chain_.offset(states_[i]);
      rows.push_back(
          {first + core::kPosition, first + core::kOrientation, units[core::kPosition], units[core::kOrientation]});
    }
    bound_.ate = aligned_bound(chain_, poses, rows, bound_.poses, options_.alignment);
  }

  void add_kappa2() {
    const auto kappa2 = [&](const VisualGaps& gaps, double sigma_px) {
      if (gaps.observations == 0) return 0.0;
      const double pixels = log_.imu_noise.gyro_noise_density * truth_.calibration.camera(log_.camera).fx_px / sigma_px;
      const double mean_gap_s = gaps.sum_s / gaps.observations;
      return pixels * pixels * mean_gap_s *
             (static_cast<double>(gaps.observations) / static_cast<double>(options_.frames.size()));
    };
    bound_.kappa2 = kappa2(visual_.point_gaps, log_.pixel_sigma_px) + kappa2(visual_.line_gaps, log_.line_sigma_px);
  }

  const core::MeasurementLog& log_;
  const sim::GroundTruth& truth_;
  const BoundOptions& options_;
  std::vector<core::ImuSample> imu_;
  std::vector<int> free_;                 // rows of the calibration that are free
  std::vector<std::size_t> samples_;      // of the states, in the log
  std::vector<core::State> true_states_;  // there
  VisualLinearisation visual_;

  InformationChain chain_;
  Variable calibration_ = -1;
  std::vector<Variable> states_;
  std::vector<Variable> landmarks_;  // of the tracks; -1 before their first observation
  std::vector<int> alive_;           // tracks
  std::vector<CausalBound> causal_;
  std::vector<Eigen::MatrixXd> marginals_;
  CramerRaoBound bound_;
};

}  // namespace

std::vector<core::ImuSample> noise_free_imu(const core::MeasurementLog& log, const sim::GroundTruth& truth) {
  const Eigen::Vector3d gravity_W(0.0, 0.0, -log.gravity_m_s2);
  std::vector<core::ImuSample> samples;
  samples.reserve(log.imu.size());
  for (const core::ImuSample& measured : log.imu) {
    const auto at = std::lower_bound(truth.states.begin(), truth.states.end(), measured.t_ns,
                                     [](const core::StampedState& s, core::TimeNs t) { return s.t_ns < t; });
    if (at == truth.states.end()) throw std::domain_error("an IMU sample lies outside the truth");
    const auto before = at == truth.states.begin() ? at : at - 1;
    const auto after = at + 1 == truth.states.end() ? at : at + 1;
    const double dt_s = core::to_seconds(after->t_ns - before->t_ns);
    const Eigen::Quaterniond turn = before->state.T_W_B.q.conjugate() * after->state.T_W_B.q;
    const Eigen::Vector3d accel_W = (after->state.v_W - before->state.v_W) / dt_s;
    const core::ImuBias& bias = at->state.bias;
    samples.push_back({.t_ns = measured.t_ns,
                       .gyro_rad_s = core::log_so3(turn) / dt_s + bias.gyro_rad_s,
                       .accel_m_s2 = at->state.T_W_B.q.conjugate() * (accel_W - gravity_W) + bias.accel_m_s2});
  }
  return samples;
}

CramerRaoBound cramer_rao_bound(const core::MeasurementLog& log, const sim::GroundTruth& truth,
                                const BoundOptions& options) {
  return Builder(log, truth, options).build();
}

}  // namespace plumbline::eval
