// Segments that a simulated recording sees: both ends of pieces of straight edges, each exposed with its own row, for
// as long as both lie in the picture.
#pragma once

#include <algorithm>
#include <cstdint>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "core/random.h"
#include "core/time.h"
#include "sim/frame_view.h"
#include "sim/simulate.h"

namespace plumbline::testing {

struct SimulatedLines {
  int segments = 400;  // in the world
  int per_frame = 25;
  double sigma_px = 1.0;
  double nearest_m = 2.0;  // of the world's segments, from the places that the body passes
  double farthest_m = 5.0;
  double shortest_px = 60.0;
};

inline std::vector<sim::Segment> random_segments(const sim::Trajectory& trajectory, double duration_s,
                                                 const SimulatedLines& lines, const core::RandomStream& random) {
  std::vector<sim::Segment> segments;
  for (std::uint64_t i = 0; i < static_cast<std::uint64_t>(lines.segments); ++i) {
    const Eigen::Vector3d from = trajectory.pose_at(duration_s * random.uniform(i, 0)).p;
    const double distance_m = lines.nearest_m + (lines.farthest_m - lines.nearest_m) * random.uniform(i, 1);
    const Eigen::Vector3d middle = from + distance_m * random.normal3(i, 2).normalized();
    const Eigen::Vector3d half = (0.3 + 0.5 * random.uniform(i, 3)) * random.normal3(i, 4).normalized();
    segments.push_back({{middle - half, middle + half}});
  }
  return segments;
}

inline std::optional<core::LineObservation> observe_segment(const sim::FrameView& frame, const sim::Segment& segment,
                                                            const core::PinholeCamera& camera, double shortest_px) {
  core::LineObservation seen;
  seen.velocities.emplace();
  for (std::size_t e = 0; e < 2; ++e) {
    const auto exposure = frame.expose(segment.ends_W[e]);
    if (!exposure || !camera.contains(exposure->pixel) || exposure->depth_m < 0.3) return std::nullopt;
    seen.ends_px[e] = exposure->pixel;
    (*seen.velocities)[e] = frame.image_velocity(segment.ends_W[e], exposure->t_imu_s);
  }
  if ((seen.ends_px[0] - seen.ends_px[1]).norm() < shortest_px) return std::nullopt;
  return seen;
}

// Fills Frame::lines and the truth of them. Segments that were seen in the frame before come first; velocities exact.
inline void add_lines(const sim::ScenarioConfig& scenario, core::TrialId id, const SimulatedLines& lines,
                      sim::Simulation& simulation) {
  core::MeasurementLog& log = simulation.measurements;
  const auto trajectory = sim::make_trajectory(scenario.trajectory, scenario.duration_s, id);
  simulation.truth.segments_W =
      random_segments(*trajectory, scenario.duration_s, lines, {id.shared(), "simulated_lines/world"});
  const std::vector<sim::Segment>& segments = simulation.truth.segments_W;
  const core::RandomStream noise(id, "simulated_lines/noise");
  log.line_sigma_px = lines.sigma_px;
  std::map<int, std::int64_t> last;  // track of each segment of the last frame
  std::int64_t next_track = 0;
  for (std::size_t k = 0; k < log.frames.size(); ++k) {
    const sim::FrameView frame(*trajectory, log.camera, simulation.truth.calibration,
                               sim::half_angle_of_view_rad(log.camera), core::to_seconds(log.frames[k].t_cam_ns));
    std::vector<std::pair<int, core::LineObservation>> visible;
    for (int i = 0; i < lines.segments; ++i) {
      const sim::Segment& segment = segments[static_cast<std::size_t>(i)];
      if (auto seen = observe_segment(frame, segment, log.camera, lines.shortest_px)) visible.emplace_back(i, *seen);
    }
    std::stable_partition(visible.begin(), visible.end(), [&](const auto& v) { return last.contains(v.first); });
    if (visible.size() > static_cast<std::size_t>(lines.per_frame)) {
      visible.resize(static_cast<std::size_t>(lines.per_frame));
    }
    std::map<int, std::int64_t> tracks;
    for (auto& [segment, seen] : visible) {
      const auto continued = last.find(segment);
      seen.track_id = continued != last.end() ? continued->second : next_track++;
      tracks[segment] = seen.track_id;
      simulation.truth.track_segment[seen.track_id] = segment;
      for (std::size_t e = 0; e < 2; ++e) {
        seen.ends_px[e] += lines.sigma_px * noise.normal2(k, 2 * static_cast<std::uint64_t>(segment) + e);
      }
      log.frames[k].lines.push_back(seen);
    }
    last = std::move(tracks);
  }
}

inline sim::Simulation simulate_with_lines(const sim::ScenarioConfig& scenario, core::TrialId id,
                                           const SimulatedLines& lines) {
  sim::Simulation simulation = sim::simulate(scenario, id);
  add_lines(scenario, id, lines, simulation);
  return simulation;
}

}  // namespace plumbline::testing
