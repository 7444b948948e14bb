#include "sim/line_velocity.h"

#include <array>
#include <map>
#include <optional>

#include "core/time.h"

namespace plumbline::sim {
namespace {

// An observation with its ends in normalised coordinates.
struct Seen {
  core::LineObservation* line;
  std::array<Eigen::Vector2d, 2> ends;
};

std::optional<Seen> normalised(core::LineObservation& line, const core::PinholeCamera& camera) {
  const auto first = camera.try_unproject(line.ends_px[0]);
  const auto second = camera.try_unproject(line.ends_px[1]);
  if (!first || !second) return std::nullopt;
  return Seen{&line, {first->head<2>(), second->head<2>()}};
}

// Of the ends of `at` by their ways across the line of `other`, which was seen dt_s later (earlier where negative).
std::optional<std::array<Eigen::Vector2d, 2>> velocities(const Seen& at, const Seen& other, double dt_s,
                                                         const core::PinholeCamera& camera, double readout_s) {
  const Eigen::Vector2d along = other.ends[1] - other.ends[0];
  if (!(along.squaredNorm() > 0.0)) return std::nullopt;
  std::array<Eigen::Vector2d, 2> v;
  for (const std::size_t k : {std::size_t{0}, std::size_t{1}}) {
    const Eigen::Vector2d foot = other.ends[0] + along * (along.dot(at.ends[k] - other.ends[0]) / along.squaredNorm());
    const auto pixel = camera.project({foot.x(), foot.y(), 1.0});
    if (!pixel) return std::nullopt;
    const double between_s = dt_s + (pixel->y() - at.line->ends_px[k].y()) / camera.height_px * readout_s;
    // Where the rows are read in the other order than the frames, no velocity is told.
    if (!(between_s * dt_s > 0.0)) return std::nullopt;
    v[k] = (foot - at.ends[k]) / between_s;
  }
  return v;
}

}  // namespace

void add_finite_difference_line_velocities(std::vector<core::Frame>& frames, const core::PinholeCamera& camera,
                                           double nominal_readout_s) {
  std::map<std::int64_t, Seen> before;
  core::TimeNs before_ns = 0;
  for (core::Frame& frame : frames) {
    std::map<std::int64_t, Seen> now;
    for (core::LineObservation& line : frame.lines) {
      const auto seen = normalised(line, camera);
      if (!seen) continue;
      now.insert({line.track_id, *seen});
      const auto last = before.find(line.track_id);
      if (last == before.end()) continue;
      const double dt_s = core::to_seconds(frame.t_cam_ns - before_ns);
      line.velocities = velocities(*seen, last->second, -dt_s, camera, nominal_readout_s);
      core::LineObservation& first = *last->second.line;
      if (!first.velocities) first.velocities = velocities(last->second, *seen, dt_s, camera, nominal_readout_s);
    }
    before = std::move(now);
    before_ns = frame.t_cam_ns;
  }
}

}  // namespace plumbline::sim
