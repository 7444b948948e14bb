#include "sim/face_lines.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <set>

#include "core/error.h"
#include "sim/wall_landmarks.h"

namespace plumbline::sim {
namespace {

// Neither the eye nor a detector makes anything of a shorter one.
constexpr double kShortestM = 0.02;

// The shares of the way from p to q that lie in the box (slab by slab); nothing where it passes by.
std::optional<Stretch> part_within(const Eigen::AlignedBox2d& box, const Eigen::Vector2d& p, const Eigen::Vector2d& q) {
  Stretch within;
  for (const int axis : {0, 1}) {
    const double way = q[axis] - p[axis];
    if (way == 0.0) {
      if (p[axis] < box.min()[axis] || p[axis] > box.max()[axis]) return std::nullopt;
      continue;
    }
    const double enter = ((way > 0.0 ? box.min() : box.max())[axis] - p[axis]) / way;
    const double leave = ((way > 0.0 ? box.max() : box.min())[axis] - p[axis]) / way;
    within = {std::max(within.from, enter), std::min(within.to, leave)};
  }
  if (within.from > within.to) return std::nullopt;
  return within;
}

void draw(const Eigen::Vector3d& from, const Eigen::Vector3d& to, std::vector<Segment>& segments_W) {
  if ((to - from).norm() >= kShortestM) segments_W.push_back({{from, to}});
}

Eigen::Vector3d before(const Wall& face, const Eigen::Vector2d& ab) {
  return face.at(ab) + kBeforeWallM * face.normal_W();
}

// The face that an upright one ends at, in the corner at a = 0 (`first`) or a = size: preferably one that faces it
// (an inner corner), else one behind it that faces away (an outer corner).
const Wall* neighbour(const std::vector<Wall>& faces, const Wall& face, bool first) {
  constexpr double kNearM = 1e-6;
  const Eigen::Vector3d corner = face.at({first ? 0.0 : face.size_m.x(), 0.0});
  const Eigen::Vector3d inwards = first ? face.u_W : Eigen::Vector3d(-face.u_W);
  const Wall* outer = nullptr;
  for (const Wall& other : faces) {
    const Eigen::Vector3d d = corner - other.corner_W;
    const double a = d.dot(other.u_W);
    const bool touches = std::abs(d.dot(other.normal_W())) < kNearM && a > -kNearM && a < other.size_m.x() + kNearM;
    const double facing = other.normal_W().dot(inwards);
    if (!touches || std::abs(facing) < 0.5) continue;
    // How far it reaches to the front of the face, and behind it.
    const double u = other.u_W.dot(face.normal_W());
    const double front = std::max(-a * u, (other.size_m.x() - a) * u);
    const double behind = std::max(a * u, (a - other.size_m.x()) * u);
    if (facing > 0.0 && front > kNearM) return &other;
    if (facing < 0.0 && behind > kNearM) outer = &other;
  }
  return outer;
}

}  // namespace

std::vector<Stretch> solid_stretches(const Wall& face, const Eigen::Vector2d& p, const Eigen::Vector2d& q) {
  std::vector<Stretch> open;
  for (const Eigen::AlignedBox2d& box : face.openings) {
    if (const auto part = part_within(box, p, q)) open.push_back(*part);
  }
  std::sort(open.begin(), open.end(), [](const Stretch& x, const Stretch& y) { return x.from < y.from; });
  std::vector<Stretch> solid;
  double from = 0.0;
  for (const Stretch& gap : open) {
    if (gap.from > from) solid.push_back({from, gap.from});
    from = std::max(from, gap.to);
  }
  if (from < 1.0) solid.push_back({from, 1.0});
  return solid;
}

void draw_line(const Wall& face, const Eigen::Vector2d& p, const Eigen::Vector2d& q, std::vector<Segment>& segments_W) {
  for (const Stretch& part : solid_stretches(face, p, q)) {
    draw(before(face, p + part.from * (q - p)), before(face, p + part.to * (q - p)), segments_W);
  }
}

void draw_outline(const Wall& face, double inset_m, std::vector<Segment>& segments_W) {
  const Eigen::Vector2d low = Eigen::Vector2d::Constant(inset_m);
  const Eigen::Vector2d high = face.size_m - low;
  const std::array<Eigen::Vector2d, 4> corners = {low, {high.x(), low.y()}, high, {low.x(), high.y()}};
  for (std::size_t i = 0; i < 4; ++i) draw_line(face, corners[i], corners[(i + 1) % 4], segments_W);
}

void draw_door_frames(const Wall& face, std::vector<Segment>& segments_W) {
  for (const Eigen::AlignedBox2d& door : face.openings) {
    // Beside the opening, not on its border.
    const double left = door.min().x() - kBeforeWallM;
    const double right = door.max().x() + kBeforeWallM;
    const double bottom = kBeforeWallM;
    const double top = std::min(door.max().y() + kBeforeWallM, face.size_m.y() - kBeforeWallM);
    if (left > 0.0) draw_line(face, {left, bottom}, {left, top}, segments_W);
    if (right < face.size_m.x()) draw_line(face, {right, bottom}, {right, top}, segments_W);
    if (top > door.max().y()) {
      const double last = face.size_m.x() - kBeforeWallM;
      draw_line(face, {std::max(left, kBeforeWallM), top}, {std::min(right, last), top}, segments_W);
    }
  }
}

void draw_windows(const Wall& face, const WindowsConfig& config, std::vector<Segment>& segments_W) {
  const double top = config.sill_m + config.height_m;
  const int count = static_cast<int>(face.size_m.x() / config.spacing_m);
  if (top > face.size_m.y() - kBeforeWallM || config.sill_m < kBeforeWallM) return;
  for (int i = 0; i < count; ++i) {
    const double centre = (i + 0.5) * face.size_m.x() / count;
    const Eigen::AlignedBox2d window(Eigen::Vector2d(centre - 0.5 * config.width_m, config.sill_m),
                                     Eigen::Vector2d(centre + 0.5 * config.width_m, top));
    const bool fits = window.min().x() > kBeforeWallM && window.max().x() < face.size_m.x() - kBeforeWallM &&
                      std::none_of(
                          face.openings.begin(), face.openings.end(),
                          [&](const Eigen::AlignedBox2d& door) { return door.intersects(window); });
    if (!fits) continue;
    Wall pane = face;
    pane.corner_W = face.at(window.min());
    pane.size_m = window.sizes();
    pane.openings.clear();
    draw_outline(pane, 0.0, segments_W);
  }
}

void draw_grid(const Wall& face, double spacing_m, std::vector<Segment>& segments_W) {
  const Eigen::Vector2d& size = face.size_m;
  const Eigen::Vector2d last = size.array() - kBeforeWallM;
  for (int k = 1; k * spacing_m < last.x(); ++k) {
    draw_line(face, {k * spacing_m, kBeforeWallM}, {k * spacing_m, last.y()}, segments_W);
  }
  for (int k = 1; k * spacing_m < last.y(); ++k) {
    draw_line(face, {kBeforeWallM, k * spacing_m}, {last.x(), k * spacing_m}, segments_W);
  }
}

void draw_edges(const std::vector<Wall>& upright_faces, std::vector<Segment>& segments_W) {
  std::set<std::array<std::int64_t, 3>> posts;  // tenths of millimetres of those that are drawn
  for (const Wall& face : upright_faces) {
    const double bottom = kBeforeWallM;
    const double top = face.size_m.y() - kBeforeWallM;
    // The inner walls of a face lie kBeforeWallM before it too, so that neither sees through the other.
    std::array<double, 2> a{};
    for (const bool first : {true, false}) {
      const Wall* other = neighbour(upright_faces, face, first);
      const double end = first ? 0.0 : face.size_m.x();
      const double shift = other != nullptr ? kBeforeWallM * other->normal_W().dot(face.u_W) : 0.0;
      a[first ? 0 : 1] = end + shift;
      if (other == nullptr) continue;
      const Eigen::Vector3d foot = before(face, {end + shift, bottom});
      std::array<std::int64_t, 3> key{};
      for (std::size_t i = 0; i < 3; ++i) key[i] = std::llround(1e4 * foot[static_cast<int>(i)]);
      if (posts.insert(key).second) draw_line(face, {end + shift, bottom}, {end + shift, top}, segments_W);
    }
    draw_line(face, {a[0], bottom}, {a[1], bottom}, segments_W);
    draw_line(face, {a[0], top}, {a[1], top}, segments_W);
  }
}

void scatter_lines_on(const std::vector<Wall>& faces, const WorldLinesConfig& config, const core::RandomStream& stream,
                      std::vector<Segment>& segments_W) {
  const FacesByArea by_area(faces);
  // Those that meet a door, or have hardly any length within the face, are drawn again.
  constexpr std::uint64_t kMostDraws = 10000;
  for (int i = 0; i < config.random; ++i) {
    for (std::uint64_t draw_number = 0;; ++draw_number) {
      if (draw_number == kMostDraws) {
        throw core::RuleError(
            {"scenario.world.lines",
             "must be shorter, or doors smaller: the walls have hardly any area for random segments"});
      }
      const auto index = static_cast<std::uint64_t>(i);
      const auto place = stream.uniforms(index, 2 * draw_number);
      const auto shape = stream.uniforms(index, 2 * draw_number + 1);
      const Wall& face = by_area.at(place[0]);
      const Eigen::Vector2d middle(place[1] * face.size_m.x(), place[2] * face.size_m.y());
      const double length_m =
          config.random_shortest_m + shape[0] * (config.random_longest_m - config.random_shortest_m);
      const double angle = std::numbers::pi * shape[1];
      const Eigen::Vector2d half = 0.5 * length_m * Eigen::Vector2d(std::cos(angle), std::sin(angle));
      // Not in the planes of the walls that meet the face, from both sides of which it would be seen.
      const Eigen::Vector2d inset = Eigen::Vector2d::Constant(kBeforeWallM);
      const auto part = part_within({inset, face.size_m - inset}, middle - half, middle + half);
      if (!part || (part->to - part->from) * length_m < kShortestM) continue;
      const Eigen::Vector2d p = middle - half + 2.0 * part->from * half;
      const Eigen::Vector2d q = middle - half + 2.0 * part->to * half;
      const auto solid = solid_stretches(face, p, q);
      if (solid.size() != 1 || solid.front().from > 0.0 || solid.front().to < 1.0) continue;
      draw(before(face, p), before(face, q), segments_W);
      break;
    }
  }
}

}  // namespace plumbline::sim
