#include "sim/track_velocity.h"

#include <map>

#include "core/time.h"

namespace plumbline::sim {

void add_finite_difference_velocities(std::vector<core::Frame>& frames, const core::PinholeCamera& camera,
                                      double nominal_readout_s) {
  struct Seen {
    core::PointObservation* point;
    Eigen::Vector2d normalised;
  };
  std::map<std::int64_t, Seen> before;
  core::TimeNs before_ns = 0;
  for (core::Frame& frame : frames) {
    std::map<std::int64_t, Seen> now;
    for (core::PointObservation& point : frame.points) {
      const auto bearing = camera.try_unproject(point.pixel);
      if (!bearing) continue;
      const Eigen::Vector2d normalised = bearing->head<2>();
      now.insert({point.track_id, {&point, normalised}});
      const auto last = before.find(point.track_id);
      if (last == before.end()) continue;
      core::PointObservation& first = *last->second.point;
      const double rows = (point.pixel.y() - first.pixel.y()) / camera.height_px;
      const double dt_s = core::to_seconds(frame.t_cam_ns - before_ns) + rows * nominal_readout_s;
      // Where the rows are read in the other order than the frames, no velocity is told.
      if (!(dt_s > 0.0)) continue;
      point.velocity = (normalised - last->second.normalised) / dt_s;
      if (!first.velocity) first.velocity = point.velocity;
    }
    before = std::move(now);
    before_ns = frame.t_cam_ns;
  }
}

}  // namespace plumbline::sim
