#include "eval/metric_bound.h"

#include <array>
#include <cmath>

namespace plumbline::eval {
namespace {

struct Block {
  std::string_view metric;
  int row;  // in core::PosteriorCovariance
  int dof;
  double unit;
};

constexpr int kState = core::kCovLastState;
constexpr std::array<Block, 14> kBlocks = {{
    {"td_error_s", core::kCovTd, 1, 1.0},
    {"readout_error_s", core::kCovReadout, 1, 1.0},
    {"extrinsic_position_m", core::kCovExtrinsicPosition, 3, 1.0},
    {"extrinsic_rotation_deg", core::kCovExtrinsicRotation, 3, core::kDegreesPerRadian},
    {"extrinsic", core::kCovExtrinsicPosition, 3, 1.0},
    {"focal_error_px", core::kCovIntrinsics, 2, 1.0},
    {"principal_point_error_px", core::kCovIntrinsics + 2, 2, 1.0},
    {"intrinsics", core::kCovIntrinsics, 4, 1.0},
    {"final_pose", kState + core::kPosition, 3, 1.0},
    {"final_position", kState + core::kPosition, 3, 1.0},
    {"final_orientation_deg", kState + core::kOrientation, 3, core::kDegreesPerRadian},
    {"final_velocity", kState + core::kVelocity, 3, 1.0},
    {"final_gyro_bias", kState + core::kGyroBias, 3, 1.0},
    {"final_accel_bias", kState + core::kAccelBias, 3, 1.0},
}};

}  // namespace

std::optional<double> metric_bound(const CramerRaoBound& bound, std::string_view metric) {
  if (metric == "ate_position_m") return bound.ate.position_m;
  if (metric == "ate_rotation_deg") return bound.ate.rotation_rad * core::kDegreesPerRadian;
  const core::PosteriorCovariance& P = bound.covariance;
  if (metric == "td_first_error_s") {
    const double variance = P(core::kCovTd, core::kCovTd) - P(core::kCovTd, core::kCovReadout) +
                            0.25 * P(core::kCovReadout, core::kCovReadout);
    if (!(variance > 0.0)) return std::nullopt;
    return std::sqrt(variance);
  }
  for (const Block& block : kBlocks) {
    if (block.metric != metric) continue;
    const double trace = P.diagonal().segment(block.row, block.dof).sum();
    if (!(trace > 0.0)) return std::nullopt;
    return block.unit * std::sqrt(trace);
  }
  return std::nullopt;
}

void add_bounds(const CramerRaoBound& bound, std::vector<Metric>& metrics) {
  for (Metric& metric : metrics) metric.crlb = metric_bound(bound, metric.name);
}

std::vector<BoundPoint> bound_series(const CramerRaoBound& bound, core::TimeNs start) {
  std::vector<core::TimeNs> stamps;
  stamps.reserve(bound.causal.size());
  for (const CausalBound& causal : bound.causal) stamps.push_back(causal.t_ns);
  std::vector<BoundPoint> points;
  for (const int k : grid_indices(stamps)) {
    const CausalBound& causal = bound.causal[static_cast<std::size_t>(k)];
    const PoseCovariance& pose = bound.poses[static_cast<std::size_t>(k) + 1];  // the first is the prior's
    const auto root = [&](int row, int dof) { return std::sqrt(causal.covariance.diagonal().segment(row, dof).sum()); };
    points.push_back({.t_s = core::to_seconds(causal.t_ns - start),
                      .td_s = root(core::kCovTd, 1),
                      .readout_s = root(core::kCovReadout, 1),
                      .position_m = root(kState + core::kPosition, 3),
                      .orientation_rad = root(kState + core::kOrientation, 3),
                      .position_in_the_end_m = std::sqrt(pose.diagonal().head<3>().sum()),
                      .orientation_in_the_end_rad = std::sqrt(pose.diagonal().tail<3>().sum())});
  }
  return points;
}

}  // namespace plumbline::eval
