#include "sim/spline_trajectory.h"

#include <algorithm>
#include <cmath>

#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <fmt/format.h>

#include "core/error.h"

namespace plumbline::sim {
namespace {

constexpr int kOrder = 6;  // degree + 1
using Basis = Eigen::Matrix<double, kOrder, 1>;
using Blending = Eigen::Matrix<double, kOrder, kOrder>;

double binomial(int n, int k) {
  double b = 1.0;
  for (int i = 1; i <= k; ++i) b = b * (n - k + i) / i;
  return b;
}

// M with B(u) = M (1, u, ..., u^5): Sommer et al., eq. 5.
Blending blending_matrix() {
  Blending M;
  double factorial = 1.0;
  for (int i = 2; i < kOrder; ++i) factorial *= i;
  for (int s = 0; s < kOrder; ++s) {
    for (int n = 0; n < kOrder; ++n) {
      double sum = 0.0;
      for (int l = s; l < kOrder; ++l) {
        sum += ((l - s) % 2 == 0 ? 1.0 : -1.0) * binomial(kOrder, l - s) * std::pow(kOrder - 1 - l, kOrder - 1 - n);
      }
      M(s, n) = binomial(kOrder - 1, n) / factorial * sum;
    }
  }
  return M;
}

const Blending& blending() {
  static const Blending M = blending_matrix();
  return M;
}

// lambda_j = sum_{s >= j} B_s
const Blending& cumulative_blending() {
  static const Blending M = [] {
    Blending C = blending();
    for (int s = kOrder - 2; s >= 0; --s) C.row(s) += C.row(s + 1);
    return C;
  }();
  return M;
}

// (1, u, ..., u^5) differentiated `derivative` times.
Basis powers(double u, int derivative) {
  Basis b = Basis::Zero();
  for (int n = derivative; n < kOrder; ++n) {
    double factor = 1.0;
    for (int k = 0; k < derivative; ++k) factor *= n - k;
    b[n] = factor * std::pow(u, n - derivative);
  }
  return b;
}

}  // namespace

SplineTrajectory::SplineTrajectory(std::vector<core::Pose> controls, double knot_interval_s)
    : knot_interval_s_(knot_interval_s) {
  for (const core::Pose& pose : controls) {
    positions_.push_back(pose.p);
    orientations_.push_back(pose.q);
  }
  for (std::size_t i = 0; i + 1 < orientations_.size(); ++i) {
    steps_.push_back(core::log_so3(Eigen::Quaterniond(orientations_[i].conjugate() * orientations_[i + 1])));
  }
}

SplineTrajectory::Segment SplineTrajectory::segment(double t_s) const {
  const double knots = t_s / knot_interval_s_;
  const double last = static_cast<double>(positions_.size() - kOrder);
  const double first = std::clamp(std::floor(knots), 0.0, last);
  return {static_cast<std::size_t>(first), knots - first};
}

Kinematics SplineTrajectory::at(double t_s) const {
  const auto [first, u] = segment(t_s);
  const double rate = 1.0 / knot_interval_s_;
  const std::array<Basis, 3> u_powers = {powers(u, 0), powers(u, 1) * rate, powers(u, 2) * (rate * rate)};

  Kinematics k;
  std::array<Eigen::Vector3d, 3> p;
  for (std::size_t d = 0; d < 3; ++d) {
    const Basis b = blending() * u_powers[d];
    p[d].setZero();
    for (std::size_t j = 0; j < kOrder; ++j) p[d] += b[static_cast<int>(j)] * positions_[first + j];
  }

  const Basis lambda = cumulative_blending() * u_powers[0];
  const Basis d_lambda = cumulative_blending() * u_powers[1];
  const Basis dd_lambda = cumulative_blending() * u_powers[2];
  Eigen::Quaterniond q = orientations_[first];
  Eigen::Vector3d omega = Eigen::Vector3d::Zero();
  Eigen::Vector3d alpha = Eigen::Vector3d::Zero();
  for (int j = 1; j < kOrder; ++j) {
    const Eigen::Vector3d& step = steps_[first + static_cast<std::size_t>(j) - 1];
    const Eigen::Quaterniond A = core::exp_quaternion(lambda[j] * step);
    q = q * A;
    omega = A.conjugate() * omega + d_lambda[j] * step;
    alpha = A.conjugate() * alpha + d_lambda[j] * omega.cross(step) + dd_lambda[j] * step;
  }
  return {.T_W_B = {q.normalized(), p[0]}, .v_W = p[1], .a_W = p[2], .omega_B = omega, .alpha_B = alpha};
}

core::Pose SplineTrajectory::pose_at(double t_s) const {
  const auto [first, u] = segment(t_s);
  const Basis u_powers = powers(u, 0);
  const Basis b = blending() * u_powers;
  const Basis lambda = cumulative_blending() * u_powers;
  Eigen::Vector3d p = b[0] * positions_[first];
  Eigen::Quaterniond q = orientations_[first];
  for (int j = 1; j < kOrder; ++j) {
    const std::size_t i = first + static_cast<std::size_t>(j);
    p += b[j] * positions_[i];
    q = q * core::exp_quaternion(lambda[j] * steps_[i - 1]);
  }
  return {q.normalized(), p};
}

namespace {

// The poses that a fit of [start, start + duration] uses, with times from start.
struct Sample {
  double t_s;
  core::Pose pose;
};

std::vector<Sample> samples_in_span(const std::vector<core::StampedPose>& poses, const TrajectoryConfig& config,
                                    double begin_s, double end_s) {
  const std::string file = config.file.generic_string();
  const double length_s = core::to_seconds(poses.back().t_ns - poses.front().t_ns);
  std::vector<Sample> samples;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const double t = core::to_seconds(poses[i].t_ns - poses.front().t_ns) - config.start_s;
    // The gap before this pose counts if any of it lies in the span, even where neither of its poses does.
    const double gap_s = i == 0 ? 0.0 : core::to_seconds(poses[i].t_ns - poses[i - 1].t_ns);
    if (gap_s > config.largest_gap_s && t > begin_s && t - gap_s < end_s) {
      throw core::DataError(
          fmt::format("{}: gap of {:.3f} s between the poses at {:.3f} s and {:.3f} s after the first; "
                      "scenario.trajectory.largest_gap_s is {}",
                      file, gap_s, t - gap_s + config.start_s, t + config.start_s, config.largest_gap_s));
    }
    if (t >= begin_s && t <= end_s) samples.push_back({t, poses[i].T_W_B});
  }
  if (samples.size() < 2) {
    throw core::DataError(fmt::format("{}: no poses at scenario.trajectory.start_s = {}; the file spans {:.3f} s", file,
                                      config.start_s, length_s));
  }
  return samples;
}

}  // namespace

SplineFit fit_spline(const std::vector<core::StampedPose>& poses, const TrajectoryConfig& config, double duration_s) {
  const double length_s = core::to_seconds(poses.back().t_ns - poses.front().t_ns);
  if (config.start_s + duration_s > length_s) {
    throw core::DataError(
        fmt::format("{}: scenario.trajectory.start_s + scenario.duration_s = {} s, but the file spans only {:.3f} s",
                    config.file.generic_string(), config.start_s + duration_s, length_s));
  }

  // A few knots beyond the span where the file has them: the ends of a spline are its least certain part.
  const double knot_s = config.knot_interval_s;
  const double margin_s = kOrder * knot_s;
  const double begin_s = -std::min(margin_s, config.start_s);
  const double end_s = std::min(duration_s + margin_s, length_s - config.start_s);
  const std::vector<Sample> samples = samples_in_span(poses, config, begin_s, end_s);

  const int before = static_cast<int>(std::ceil(-begin_s / knot_s));
  const int after = static_cast<int>(std::ceil(end_s / knot_s));
  const int controls = before + after + kOrder - 1;
  const double origin_s = -before * knot_s;

  // B, one row a sample, and the normal matrix with a smoothness term far below the data's weight, which decides the
  // controls beyond the first and the last pose.
  const int rows = static_cast<int>(samples.size());
  std::vector<Eigen::Triplet<double>> entries;
  for (int r = 0; r < rows; ++r) {
    const double knots = (samples[static_cast<std::size_t>(r)].t_s - origin_s) / knot_s;
    const int first = std::clamp(static_cast<int>(std::floor(knots)), 0, controls - kOrder);
    const Basis b = blending() * powers(knots - first, 0);
    for (int j = 0; j < kOrder; ++j) entries.emplace_back(r, first + j, b[j]);
  }
  Eigen::SparseMatrix<double> B(rows, controls);
  B.setFromTriplets(entries.begin(), entries.end());
  entries.clear();
  for (int i = 0; i + 3 < controls; ++i) {
    entries.emplace_back(i, i, -1.0);
    entries.emplace_back(i, i + 1, 3.0);
    entries.emplace_back(i, i + 2, -3.0);
    entries.emplace_back(i, i + 3, 1.0);
  }
  Eigen::SparseMatrix<double> D(std::max(controls - 3, 1), controls);
  D.setFromTriplets(entries.begin(), entries.end());
  constexpr double kSmoothness = 1e-6;
  const Eigen::SparseMatrix<double> smooth = kSmoothness * Eigen::SparseMatrix<double>(D.transpose() * D);
  const Eigen::SparseMatrix<double> normal = Eigen::SparseMatrix<double>(B.transpose() * B) + smooth;
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver(normal);

  // Positions: deviations from the first pose, so that the numbers stay small.
  const Eigen::Vector3d p0 = samples.front().pose.p;
  Eigen::MatrixXd residual(rows, 3);
  for (int r = 0; r < rows; ++r) residual.row(r) = (samples[static_cast<std::size_t>(r)].pose.p - p0).transpose();
  const Eigen::MatrixXd positions = solver.solve(B.transpose() * residual);

  // Start the orientations at the pose nearest to the centre of each control's support.
  std::vector<core::Pose> control_poses(static_cast<std::size_t>(controls));
  for (int i = 0; i < controls; ++i) {
    const double centre_s = origin_s + (i - 2) * knot_s;
    const auto nearest = std::min_element(samples.begin(), samples.end(), [&](const Sample& a, const Sample& b) {
      return std::abs(a.t_s - centre_s) < std::abs(b.t_s - centre_s);
    });
    control_poses[static_cast<std::size_t>(i)] = {nearest->pose.q, p0 + positions.row(i).transpose()};
  }

  constexpr int kMaxIterations = 50;
  constexpr double kConvergedRad = 1e-12;
  const auto residuals_of = [&](const SplineTrajectory& trajectory) {
    double position2 = 0.0;
    for (int r = 0; r < rows; ++r) {
      const Sample& sample = samples[static_cast<std::size_t>(r)];
      const core::Pose pose = trajectory.pose_at(sample.t_s - origin_s);
      residual.row(r) = core::log_so3(Eigen::Quaterniond(pose.q.conjugate() * sample.pose.q)).transpose();
      position2 += (pose.p - sample.pose.p).squaredNorm();
    }
    return std::sqrt(position2 / rows);
  };
  for (int iteration = 0; iteration < kMaxIterations; ++iteration) {
    residuals_of(SplineTrajectory(control_poses, knot_s));
    const Eigen::MatrixXd update = solver.solve(B.transpose() * residual);
    for (int i = 0; i < controls; ++i) {
      core::Pose& pose = control_poses[static_cast<std::size_t>(i)];
      pose.q = (pose.q * core::exp_quaternion(update.row(i).transpose())).normalized();
    }
    if (update.cwiseAbs().maxCoeff() < kConvergedRad) break;
  }

  const double position_rms = residuals_of(SplineTrajectory(control_poses, knot_s));
  const double rotation_rms = std::sqrt(residual.squaredNorm() / rows);
  // The margin before the span is cut off, so that time 0 is start_s.
  control_poses.erase(control_poses.begin(), control_poses.begin() + before);
  return {SplineTrajectory(std::move(control_poses), knot_s), {position_rms, rotation_rms}};
}

}  // namespace plumbline::sim
