#include "sim/line_sensor.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace plumbline::sim {

LineSensor::LineSensor(const World& world, const ScenarioConfig& config, core::TrialId id)
    : world_(world),
      config_(config.lines),
      tracker_(world, config.camera.model, config.lines, id),
      noise_(id, "cam0/line_noise"),
      slide_(id, "cam0/line_slide"),
      match_(id, "cam0/line_match") {}

std::vector<LineReport> LineSensor::observe(const FrameView& view, std::uint64_t frame_index) {
  const std::vector<LineSighting> sightings = tracker_.advance(view, frame_index);
  std::vector<LineReport> reports;
  reports.reserve(sightings.size());
  for (const LineSighting& sighting : sightings) reports.push_back(report(sighting, view, frame_index));
  match_wrongly(reports, sightings, frame_index);
  return reports;
}

LineReport LineSensor::report(const LineSighting& sighting, const FrameView& view, std::uint64_t frame_index) const {
  LineReport r{.observation = {.track_id = sighting.track_id},
               .track_segment = sighting.segment,
               .segment = sighting.segment,
               .ends = slid_ends(sighting, view, frame_index)};
  const auto n = noise_.normals(frame_index, sighting.draw);
  const auto [first, second] = r.ends;
  r.observation.ends_px = {first.exposure.pixel + config_.sigma_px * Eigen::Vector2d(n[0], n[1]),
                           second.exposure.pixel + config_.sigma_px * Eigen::Vector2d(n[2], n[3])};
  if (config_.velocity_source == VelocitySource::kExact) {
    const Segment& segment = world_.segments_W[static_cast<std::size_t>(sighting.segment)];
    r.observation.velocities = {view.image_velocity(segment.at(first.s), first.exposure.t_imu_s),
                                view.image_velocity(segment.at(second.s), second.exposure.t_imu_s)};
  }
  return r;
}

std::array<PieceEnd, 2> LineSensor::slid_ends(const LineSighting& sighting, const FrameView& view,
                                              std::uint64_t frame_index) const {
  const VisiblePiece& piece = sighting.piece;
  if (config_.slide_sigma_px == 0.0) return piece.ends;
  const auto n = slide_.normals(frame_index, sighting.draw);
  const double length_px = piece.length_px();
  std::array<double, 2> share = {config_.slide_sigma_px * std::abs(n[0]) / length_px,
                                 config_.slide_sigma_px * std::abs(n[1]) / length_px};
  const double most = std::max(1.0 - config_.shortest_px / length_px, 0.0);
  const double total = share[0] + share[1];
  if (total > most) {
    for (double& x : share) x *= most / total;
  }
  std::array<PieceEnd, 2> ends = piece.ends;
  const Segment& segment = world_.segments_W[static_cast<std::size_t>(sighting.segment)];
  for (const std::size_t k : {std::size_t{0}, std::size_t{1}}) {
    const double s = at_image_share(piece, k == 0 ? share[0] : 1.0 - share[1]);
    // All of the piece is seen but, at most, slivers that its search for places stepped over: there the end stays.
    if (const auto exposure = view.expose(segment.at(s))) ends[k] = {s, *exposure};
  }
  return ends;
}

void LineSensor::match_wrongly(std::vector<LineReport>& reports, const std::vector<LineSighting>& sightings,
                               std::uint64_t frame_index) const {
  if (config_.wrong_match_probability == 0.0) return;
  struct Draw {
    double order;
    double chance;
    std::size_t report;
  };
  std::vector<Draw> draws;
  draws.reserve(sightings.size());
  for (std::size_t i = 0; i < sightings.size(); ++i) {
    const auto u = match_.uniforms(frame_index, sightings[i].draw);
    draws.push_back({u[0], u[1], i});
  }
  std::sort(draws.begin(), draws.end(), [](const Draw& a, const Draw& b) { return a.order < b.order; });
  for (std::size_t i = 0; i + 1 < draws.size(); i += 2) {
    if (draws[i].chance >= config_.wrong_match_probability) continue;
    LineReport& a = reports[draws[i].report];
    LineReport& b = reports[draws[i + 1].report];
    std::swap(a.observation.track_id, b.observation.track_id);
    std::swap(a.track_segment, b.track_segment);
  }
}

}  // namespace plumbline::sim
