#include "eval/line_error.h"

#include <cmath>
#include <vector>

#include <Eigen/Geometry>

#include "core/lie.h"
#include "eval/statistics.h"

namespace plumbline::eval {

LineError line_error(const core::LineEstimate& line, const sim::Segment& truth) {
  const Eigen::Vector3d direction = (truth.ends_W[1] - truth.ends_W[0]).normalized();
  const Eigen::Vector3d& d = line.direction_W;
  // By sine and cosine: the arc cosine alone has no digits at small angles.
  const double angle_rad = std::atan2(d.cross(direction).norm(), std::abs(d.dot(direction)));
  double squares = 0.0;
  for (const Eigen::Vector3d& P : truth.ends_W) squares += (P.cross(d) - line.moment_W).squaredNorm();
  return {.angle_deg = angle_rad * core::kDegreesPerRadian, .distance_m = std::sqrt(0.5 * squares)};
}

LineErrors line_errors(const core::EstimateLog& estimate, const sim::GroundTruth& truth) {
  LineErrors errors;
  std::vector<double> angles_deg;
  std::vector<double> distances_m;
  for (const core::LineEstimate& line : estimate.lines) {
    const auto segment = truth.track_segment.find(line.track_id);
    if (segment == truth.track_segment.end()) continue;  // a false track has no truth
    const LineError e = line_error(line, truth.segments_W[static_cast<std::size_t>(segment->second)]);
    angles_deg.push_back(e.angle_deg);
    distances_m.push_back(e.distance_m);
  }
  errors.lines = static_cast<int>(angles_deg.size());
  if (errors.lines > 0) {
    errors.angle_deg = median(angles_deg);
    errors.distance_m = median(distances_m);
  }
  if (estimate.line_tracks > 0) {
    errors.share = static_cast<double>(estimate.lines.size()) / static_cast<double>(estimate.line_tracks);
  }
  return errors;
}

}  // namespace plumbline::eval
