#include "sim/spline_fit.h"

#include <algorithm>
#include <cmath>

#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <fmt/format.h>

#include "core/bspline_basis.h"
#include "core/error.h"

namespace plumbline::sim {
namespace {

constexpr int kOrder = core::bspline::kMostOrder;
using SparseMatrix = Eigen::SparseMatrix<double>;

struct Sample {
  double t_s;  // of the file, from where the recording starts
  core::Pose pose;
};

// A run of poses, [first, last] of the file.
struct Piece {
  std::size_t first;
  std::size_t last;
};

double seconds_between(const core::StampedPose& a, const core::StampedPose& b) {
  return core::to_seconds(b.t_ns - a.t_ns);
}

// The longest run without a gap wider than largest_gap_s.
Piece longest_piece(const std::vector<core::StampedPose>& poses, double largest_gap_s) {
  Piece longest{0, 0};
  Piece run{0, 0};
  for (std::size_t i = 1; i < poses.size(); ++i) {
    const bool gap = seconds_between(poses[i - 1], poses[i]) > largest_gap_s;
    run = {gap ? i : run.first, i};
    const bool longer =
        seconds_between(poses[run.first], poses[run.last]) > seconds_between(poses[longest.first], poses[longest.last]);
    if (longer) longest = run;
  }
  return longest;
}

std::vector<Sample> samples_in_span(const std::vector<core::StampedPose>& poses, const Piece& piece,
                                    const TrajectoryConfig& config, double begin_s, double end_s) {
  std::vector<Sample> samples;
  for (std::size_t i = piece.first; i <= piece.last; ++i) {
    const double since_first_s = seconds_between(poses.front(), poses[i]);
    const double t = seconds_between(poses[piece.first], poses[i]) - config.start_s;
    // The gap before this pose counts if any of it lies in the span, even where neither of its poses does.
    const double gap_s = i == piece.first ? 0.0 : seconds_between(poses[i - 1], poses[i]);
    if (gap_s > config.largest_gap_s && t > begin_s && t - gap_s < end_s) {
      throw core::RuleError(
          {"scenario.trajectory.largest_gap_s",
           fmt::format(
               "{}: gap of {:.3f} s between the poses at {:.3f} s and {:.3f} s after the first, wider than {} s; "
               "another start_s, or on_gap: longest_segment, uses a piece without",
               config.file.generic_string(), gap_s, since_first_s - gap_s, since_first_s, config.largest_gap_s)});
    }
    if (t >= begin_s && t <= end_s) samples.push_back({t, poses[i].T_W_B});
  }
  if (samples.size() < 2) {
    throw core::RuleError(
        {"scenario.trajectory.start_s",
         fmt::format("{}: no poses at {} s; {:.3f} s of poses are there", config.file.generic_string(), config.start_s,
                     seconds_between(poses[piece.first], poses[piece.last]))});
  }
  return samples;
}

// The grid of knots: control j has its centre at origin_s + (j - 2) knot_s.
struct Grid {
  double knot_s;
  double origin_s;
  int controls;
};

// The value of each control's basis function at each sample, a row a sample.
SparseMatrix basis_matrix(const std::vector<Sample>& samples, const Grid& grid) {
  std::vector<Eigen::Triplet<double>> entries;
  for (std::size_t r = 0; r < samples.size(); ++r) {
    const double knots = (samples[r].t_s - grid.origin_s) / grid.knot_s;
    const int first = std::clamp(static_cast<int>(std::floor(knots)), 0, grid.controls - kOrder);
    const core::bspline::Basis b = core::bspline::weights(kOrder, knots - first, grid.knot_s).plain[0];
    for (int j = 0; j < kOrder; ++j) entries.emplace_back(static_cast<int>(r), first + j, b[j]);
  }
  SparseMatrix B(static_cast<Eigen::Index>(samples.size()), grid.controls);
  B.setFromTriplets(entries.begin(), entries.end());
  return B;
}

// Third differences of the controls, far below the data's weight: decides the controls beyond the first and the last
// pose.
SparseMatrix smoothness(int controls) {
  constexpr double kWeight = 1e-6;
  std::vector<Eigen::Triplet<double>> entries;
  for (int i = 0; i + 3 < controls; ++i) {
    entries.emplace_back(i, i, -1.0);
    entries.emplace_back(i, i + 1, 3.0);
    entries.emplace_back(i, i + 2, -3.0);
    entries.emplace_back(i, i + 3, 1.0);
  }
  SparseMatrix D(std::max(controls - 3, 1), controls);
  D.setFromTriplets(entries.begin(), entries.end());
  return kWeight * SparseMatrix(D.transpose() * D);
}

class Fitter {
 public:
  Fitter(const std::vector<Sample>& samples, const Grid& grid)
      : samples_(samples), grid_(grid), B_(basis_matrix(samples, grid)) {
    solver_.compute(SparseMatrix(B_.transpose() * B_) + smoothness(grid.controls));
  }

  std::vector<core::Pose> controls() const {
    std::vector<core::Pose> controls = start();
    constexpr int kMaxIterations = 50;
    constexpr double kConvergedRad = 1e-12;
    for (int iteration = 0; iteration < kMaxIterations; ++iteration) {
      const Eigen::MatrixXd update = solver_.solve(B_.transpose() * rotation_residuals(controls));
      for (int i = 0; i < grid_.controls; ++i) {
        core::Pose& pose = controls[static_cast<std::size_t>(i)];
        pose.q = (pose.q * core::exp_quaternion(update.row(i).transpose())).normalized();
      }
      if (update.cwiseAbs().maxCoeff() < kConvergedRad) break;
    }
    return controls;
  }

  FitResiduals residuals(const std::vector<core::Pose>& controls) const {
    const SplineTrajectory trajectory(controls, grid_.knot_s);
    double position2 = 0.0;
    for (const Sample& sample : samples_) {
      position2 += (trajectory.pose_at(sample.t_s - grid_.origin_s).p - sample.pose.p).squaredNorm();
    }
    const auto n = static_cast<double>(samples_.size());
    return {std::sqrt(position2 / n), std::sqrt(rotation_residuals(controls).squaredNorm() / n)};
  }

 private:
  // Positions as they stay; orientations of the pose nearest to the centre of each control's support.
  std::vector<core::Pose> start() const {
    // Deviations from the first pose, so that the numbers stay small.
    const Eigen::Vector3d p0 = samples_.front().pose.p;
    Eigen::MatrixXd offsets(B_.rows(), 3);
    for (Eigen::Index r = 0; r < B_.rows(); ++r) {
      offsets.row(r) = (samples_[static_cast<std::size_t>(r)].pose.p - p0).transpose();
    }
    const Eigen::MatrixXd positions = solver_.solve(B_.transpose() * offsets);
    std::vector<core::Pose> controls;
    auto nearest = samples_.begin();
    for (int i = 0; i < grid_.controls; ++i) {
      const double centre_s = grid_.origin_s + (i - 2) * grid_.knot_s;
      while (nearest + 1 != samples_.end() &&
             std::abs((nearest + 1)->t_s - centre_s) < std::abs(nearest->t_s - centre_s)) {
        ++nearest;
      }
      controls.push_back({nearest->pose.q, p0 + positions.row(i).transpose()});
    }
    return controls;
  }

  // Log(R(t_k)^T R_k), a row a sample.
  Eigen::MatrixXd rotation_residuals(const std::vector<core::Pose>& controls) const {
    const SplineTrajectory trajectory(controls, grid_.knot_s);
    Eigen::MatrixXd residuals(B_.rows(), 3);
    for (Eigen::Index r = 0; r < B_.rows(); ++r) {
      const Sample& sample = samples_[static_cast<std::size_t>(r)];
      const Eigen::Quaterniond q = trajectory.pose_at(sample.t_s - grid_.origin_s).q;
      residuals.row(r) = core::log_so3(Eigen::Quaterniond(q.conjugate() * sample.pose.q)).transpose();
    }
    return residuals;
  }

  const std::vector<Sample>& samples_;
  Grid grid_;
  SparseMatrix B_;
  Eigen::SimplicialLDLT<SparseMatrix> solver_;
};

}  // namespace

SplineFit fit_spline(const std::vector<core::StampedPose>& poses, const TrajectoryConfig& config, double duration_s) {
  const Piece piece =
      config.on_gap == OnGap::kLongestSegment ? longest_piece(poses, config.largest_gap_s) : Piece{0, poses.size() - 1};
  const PoseSpan span{seconds_between(poses.front(), poses[piece.first]),
                      seconds_between(poses.front(), poses[piece.last])};
  const double length_s = seconds_between(poses[piece.first], poses[piece.last]);
  const double used_s = config.speed_up * duration_s;
  if (config.start_s + used_s > length_s) {
    throw core::RuleError(
        {"scenario.trajectory.start_s",
         fmt::format("{}: start_s + speed_up * scenario.duration_s = {} s, but the {} spans only {:.3f} s",
                     config.file.generic_string(), config.start_s + used_s,
                     config.on_gap == OnGap::kLongestSegment ? "longest piece without a gap" : "file", length_s)});
  }

  // A few knots beyond the span where the file has them: the ends of a spline are its least certain part.
  const double knot_s = config.knot_interval_s;
  const double margin_s = kOrder * knot_s;
  const double begin_s = -std::min(margin_s, config.start_s);
  const double end_s = std::min(used_s + margin_s, length_s - config.start_s);
  const std::vector<Sample> samples = samples_in_span(poses, piece, config, begin_s, end_s);

  const int before = static_cast<int>(std::ceil(-begin_s / knot_s));
  const int after = static_cast<int>(std::ceil(end_s / knot_s));
  const Fitter fitter(samples,
                      {.knot_s = knot_s, .origin_s = -before * knot_s, .controls = before + after + kOrder - 1});
  std::vector<core::Pose> controls = fitter.controls();
  const FitResiduals residuals = fitter.residuals(controls);
  // The margin before the span is cut off, so that time 0 is start_s.
  controls.erase(controls.begin(), controls.begin() + before);
  return {SplineTrajectory(controls, knot_s / config.speed_up), residuals, span};
}

}  // namespace plumbline::sim
