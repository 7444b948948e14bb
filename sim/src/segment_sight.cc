#include "sim/segment_sight.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace plumbline::sim {
namespace {

constexpr int kPlaces = 12;

// How far a place is inside of each border: of the picture [px], of the range of depth [m].
using Margins = std::array<double, 6>;

Margins margins(const core::PinholeCamera& camera, double nearest_m, double farthest_m, const Exposure& e) {
  return {e.pixel.x() + 0.5,     camera.width_px - 0.5 - e.pixel.x(),
          e.pixel.y() + 0.5,     camera.height_px - 0.5 - e.pixel.y(),
          e.depth_m - nearest_m, farthest_m - e.depth_m};
}

// All of what the camera shows where every pixel of its border has a ray, else all that is in front of it.
Eigen::AlignedBox2d normalised_bounds(const core::PinholeCamera& camera) {
  constexpr int kSteps = 16;
  constexpr double kMargin = 0.02;  // for what lies between the pixels that are asked
  constexpr double kAll = 1e6;      // core::PinholeCamera::project
  Eigen::AlignedBox2d bounds;
  for (int i = 0; i <= kSteps; ++i) {
    const double u = camera.width_px * static_cast<double>(i) / kSteps - 0.5;
    const double v = camera.height_px * static_cast<double>(i) / kSteps - 0.5;
    for (const Eigen::Vector2d& pixel : {Eigen::Vector2d(u, -0.5), Eigen::Vector2d(u, camera.height_px - 0.5),
                                         Eigen::Vector2d(-0.5, v), Eigen::Vector2d(camera.width_px - 0.5, v)}) {
      const auto ray = camera.try_unproject(pixel);
      if (!ray) return {Eigen::Vector2d::Constant(-kAll), Eigen::Vector2d::Constant(kAll)};
      bounds.extend(ray->head<2>());
    }
  }
  const Eigen::Vector2d margin = kMargin * bounds.sizes();
  return {bounds.min() - margin, bounds.max() + margin};
}

struct Bracket {
  double in = 0.0;   // where the condition holds
  double out = 0.0;  // where it does not
};

template <class Holds>
Bracket bisect(Bracket b, double width, const Holds& holds) {
  while (std::abs(b.out - b.in) > width) {
    const double middle = 0.5 * (b.in + b.out);
    if (middle == b.in || middle == b.out) break;
    (holds(middle) ? b.in : b.out) = middle;
  }
  return b;
}

// s of the picture's share between a and b of a segment, whose depths are z_a and z_b.
double by_image_share(double a, double b, double z_a, double z_b, double share) {
  const double weight = share * z_a;
  return a + (b - a) * weight / (weight + (1.0 - share) * z_b);
}

}  // namespace

double at_image_share(const VisiblePiece& piece, double share) {
  const auto& [a, b] = piece.ends;
  return by_image_share(a.s, b.s, a.exposure.depth_m, b.exposure.depth_m, share);
}

SegmentSight::SegmentSight(const World& world, const core::PinholeCamera& camera, double nearest_m, double farthest_m)
    : world_(world),
      camera_(camera),
      nearest_m_(nearest_m),
      farthest_m_(farthest_m),
      bounds_(normalised_bounds(camera)) {}

bool SegmentSight::inside(const Exposure& exposure) const {
  return camera_.contains(exposure.pixel) && exposure.depth_m >= nearest_m_ && exposure.depth_m <= farthest_m_;
}

std::optional<Exposure> SegmentSight::sees(const FrameView& view, const Eigen::Vector3d& P_W) const {
  auto exposure = view.expose(P_W);
  if (!exposure || !inside(*exposure) || world_.occluded(exposure->camera_W, P_W)) return std::nullopt;
  return exposure;
}

// What is seen is searched for to first order in the motion (FrameView::glance); its ends are then solved for exactly.
struct SegmentSight::Search {
  const SegmentSight& sight;
  const FrameView& view;
  const Segment& segment;

  bool glimpsed(double s) const {
    const auto e = view.glance(segment.at(s));
    return e && sight.inside(*e) && !sight.world_.occluded(e->camera_W, segment.at(s));
  }

  bool seen(double s) const { return sight.sees(view, segment.at(s)).has_value(); }

  Margins margins_of(const Exposure& e) const { return margins(sight.camera_, sight.nearest_m_, sight.farthest_m_, e); }

  // The part of the segment that the frame may show: clipped, at the middle row, by planes about the picture and the
  // range of depth that are moved outwards by as much as any point may move. Nothing where it is empty.
  std::optional<std::array<double, 2>> possible() const {
    const Eigen::Vector3d a = view.in_middle_row(segment.at(0.0));
    const Eigen::Vector3d b = view.in_middle_row(segment.at(1.0));
    const double reach_m = view.reach_m(std::max(a.norm(), b.norm()));
    std::array<double, 2> range = {0.0, 1.0};
    // n . P >= -margin
    const auto clip = [&](const Eigen::Vector3d& n, double margin) {
      const double at_a = n.dot(a) + margin;
      const double at_b = n.dot(b) + margin;
      if (at_a < 0.0 && at_b < 0.0) range = {1.0, 0.0};
      if ((at_a < 0.0) == (at_b < 0.0)) return;
      const double s = at_a / (at_a - at_b);
      (at_a < 0.0 ? range[0] : range[1]) = at_a < 0.0 ? std::max(range[0], s) : std::min(range[1], s);
    };
    // What is behind the camera has no picture, however far it may move.
    clip(Eigen::Vector3d::UnitZ(), -std::max(sight.nearest_m_ - reach_m, 0.5 * sight.nearest_m_));
    clip(-Eigen::Vector3d::UnitZ(), sight.farthest_m_ + reach_m);
    for (const int axis : {0, 1}) {
      Eigen::Vector3d n = Eigen::Vector3d::Unit(axis);
      n.z() = -sight.bounds_.min()[axis];
      clip(n, n.norm() * reach_m);
      n = -Eigen::Vector3d::Unit(axis);
      n.z() = sight.bounds_.max()[axis];
      clip(n, n.norm() * reach_m);
    }
    if (!(range[0] < range[1])) return std::nullopt;
    return range;
  }

  // Places evenly spaced in the picture of the range, and the segment's own ends.
  std::vector<double> places(const std::array<double, 2>& range) const {
    const double z_0 = view.in_middle_row(segment.at(range[0])).z();
    const double z_1 = view.in_middle_row(segment.at(range[1])).z();
    std::vector<double> s;
    s.reserve(kPlaces + 3);
    if (range[0] > 0.0) s.push_back(0.0);
    for (int i = 0; i < kPlaces; ++i) {
      s.push_back(by_image_share(range[0], range[1], z_0, z_1, static_cast<double>(i) / kPlaces));
    }
    s.push_back(range[1]);
    if (range[1] < 1.0) s.push_back(1.0);
    return s;
  }

  // Where the margin of a border vanishes, by the secant method.
  std::optional<PieceEnd> at_border(std::size_t border, const Bracket& near) const {
    constexpr int kMaxIterations = 12;
    constexpr double kTolerance = 1e-9;
    const auto in = view.glance(segment.at(near.in));
    const auto out = view.glance(segment.at(near.out));
    if (!in || !out) return std::nullopt;
    double slope = (margins_of(*out)[border] - margins_of(*in)[border]) / (near.out - near.in);
    double s = near.in;
    double before_s = 0.0;
    double before_margin = 0.0;
    for (int i = 0; i < kMaxIterations; ++i) {
      const auto exposure = view.expose(segment.at(s));
      if (!exposure) return std::nullopt;
      const double margin = margins_of(*exposure)[border];
      if (std::abs(margin) < kTolerance) return PieceEnd{s, *exposure};
      if (i > 0) slope = (margin - before_margin) / (s - before_s);
      before_s = s;
      before_margin = margin;
      s = std::clamp(s - margin / slope, 0.0, 1.0);
      if (!std::isfinite(s)) return std::nullopt;
      if (s == before_s) return PieceEnd{s, *exposure};  // it is seen to the segment's end
    }
    return std::nullopt;
  }

  // Where a wall hides the rest: s = cut(camera at the time of s), by the secant method; `cut` is seen from a camera at
  // rest.
  std::optional<PieceEnd> at_wall(const Bracket& near, const Bracket& widest) const {
    constexpr int kMaxIterations = 12;
    constexpr double kTolerance = 1e-11;
    double slope = 1.0;
    double s = near.in;
    double before_s = 0.0;
    double before_defect = 0.0;
    for (int i = 0; i < kMaxIterations; ++i) {
      const auto exposure = view.expose(segment.at(s));
      if (!exposure) return std::nullopt;
      const auto open = [&](double x) { return !sight.world_.occluded(exposure->camera_W, segment.at(x)); };
      if (!open(widest.in) || open(widest.out)) return std::nullopt;
      const double defect = s - bisect(widest, 1e-12, open).in;
      if (std::abs(defect) < kTolerance) return PieceEnd{s, *exposure};
      if (i > 0) slope = (defect - before_defect) / (s - before_s);
      before_s = s;
      before_defect = defect;
      s = std::clamp(s - defect / slope, 0.0, 1.0);
      if (!std::isfinite(s)) return std::nullopt;
    }
    return std::nullopt;
  }

  // The last place that is seen on the way from `in`, which is seen, to `out`; the segment's own end where all is.
  std::optional<PieceEnd> by_bisection(const Bracket& widest) const {
    if (!seen(widest.in)) return std::nullopt;
    double out = widest.out;
    if (seen(out)) out = out < widest.in ? 0.0 : 1.0;
    const double s = seen(out) ? out : bisect({widest.in, out}, 1e-12, [&](double x) { return seen(x); }).in;
    const auto exposure = sight.sees(view, segment.at(s));
    return exposure ? std::optional(PieceEnd{s, *exposure}) : std::nullopt;
  }

  // Whether what is found by one condition meets the others as well, a little further in where a wall may touch it.
  bool plausible(const PieceEnd& end, double inner) const {
    constexpr double kTolerance = 1e-6;
    constexpr double kNudge = 1e-6;
    const Margins m = margins_of(end.exposure);
    return std::all_of(m.begin(), m.end(), [](double margin) { return margin > -kTolerance; }) &&
           !sight.world_.occluded(end.exposure.camera_W, segment.at(end.s + kNudge * (inner - end.s)));
  }

  // The end of what is seen between the places `in`, glimpsed, and `out`, not.
  std::optional<PieceEnd> end_between(double inner, const Bracket& widest) const {
    const Bracket near = bisect(widest, 1e-5, [&](double s) { return glimpsed(s); });
    std::optional<PieceEnd> end;
    if (const auto beyond = view.glance(segment.at(near.out))) {
      const Margins m = margins_of(*beyond);
      const auto least = std::min_element(m.begin(), m.end());
      end = *least <= 0.0 ? at_border(static_cast<std::size_t>(least - m.begin()), near) : at_wall(near, widest);
    }
    if (end && plausible(*end, inner)) return end;
    return by_bisection({inner, widest.out});
  }

  // The segment's own end, where it is glimpsed.
  std::optional<PieceEnd> own_end(double inner, double s) const {
    if (const auto exposure = sight.sees(view, segment.at(s))) return PieceEnd{s, *exposure};
    return by_bisection({inner, s});
  }
};

std::optional<VisiblePiece> SegmentSight::longest_visible(const FrameView& view, const Segment& segment) const {
  const Search search{*this, view, segment};
  const auto range = search.possible();
  if (!range) return std::nullopt;
  const std::vector<double> s = search.places(*range);
  // Places first..last of the longest run; places are even in the picture.
  std::size_t first = 0;
  std::size_t length = 0;
  for (std::size_t i = 0; i < s.size();) {
    std::size_t n = 0;
    while (i + n < s.size() && search.glimpsed(s[i + n])) ++n;
    if (n > length) {
      first = i;
      length = n;
    }
    i += n + 1;
  }
  if (length == 0) return std::nullopt;
  const std::size_t last = first + length - 1;
  const double inner = s[(first + last) / 2];
  const auto a = first == 0 ? search.own_end(inner, s[0]) : search.end_between(inner, {s[first], s[first - 1]});
  if (!a) return std::nullopt;
  const auto b =
      last + 1 == s.size() ? search.own_end(inner, s[last]) : search.end_between(inner, {s[last], s[last + 1]});
  if (!b || !(a->s < b->s)) return std::nullopt;
  return VisiblePiece{{*a, *b}};
}

}  // namespace plumbline::sim
