#include "tools/plot.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <span>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "canvas.h"

namespace plumbline::tools {
namespace {

const Colour kLandmark{205, 185, 165};
const Colour kSegment{150, 190, 225};
const Colour kWall{70, 70, 70};
const Colour kPlane{190, 150, 110};
const Colour kStart{60, 140, 30};
const Colour kEnd{50, 40, 200};

std::array<Eigen::Vector2d, 4> corners(const sim::Wall& wall) {
  const Eigen::Vector2d& size = wall.size_m;
  return {Eigen::Vector2d(0.0, 0.0), {size.x(), 0.0}, size, {0.0, size.y()}};
}

Eigen::Vector2d from_above(const Eigen::Vector3d& p) { return p.head<2>(); }

// The path with half its size about it, and all walls. Landmarks in the open may lie far beyond.
Eigen::AlignedBox2d view_of(const std::vector<Eigen::Vector3d>& path, const sim::World& world) {
  Eigen::AlignedBox2d view;
  for (const Eigen::Vector3d& p : path) view.extend(from_above(p));
  const double about_m = world.walls.walls.empty() ? std::max(0.5 * view.sizes().maxCoeff(), 1.0) : 0.0;
  view = {view.min().array() - about_m, view.max().array() + about_m};
  for (const sim::Wall& wall : world.walls.walls) {
    for (const Eigen::Vector2d& corner : corners(wall)) view.extend(from_above(wall.at(corner)));
  }
  const double margin = 0.03 * view.sizes().maxCoeff();
  return {view.min().array() - margin, view.max().array() + margin};
}

void draw_outline(Canvas& canvas, const sim::Wall& wall) {
  const auto around = corners(wall);
  for (std::size_t i = 0; i < around.size(); ++i) {
    canvas.line(from_above(wall.at(around[i])), from_above(wall.at(around[(i + 1) % around.size()])), kPlane);
  }
}

// The line of an upright wall, without its doors, which lie in their order along it.
void draw_upright(Canvas& canvas, const sim::Wall& wall) {
  double from = 0.0;
  const auto piece = [&](double to) {
    if (to > from) canvas.line(from_above(wall.at({from, 0.0})), from_above(wall.at({to, 0.0})), kWall, 3);
  };
  for (const Eigen::AlignedBox2d& opening : wall.openings) {
    piece(opening.min().x());
    from = opening.max().x();
  }
  piece(wall.size_m.x());
}

void plot_trajectory(const std::string& file, const PlotInput& input) {
  const double duration_s = input.scenario.duration_s;
  const std::vector<Eigen::Vector3d> path = sim::sample_path(input.scenario, input.trajectory).body_W;
  const sim::MotionStrength motion = sim::motion_strength(input.trajectory, duration_s);
  Canvas canvas(view_of(path, input.world),
                fmt::format("{}: path of {:.1f} m in {:g} s, from above", input.title, motion.path_m, duration_s),
                Canvas::VerticalAxis::kUp);
  canvas.draw_axes("x [m]", "y [m]");
  // A few thousand dots say where landmarks are; more would only hide the path.
  constexpr std::size_t kMostDots = 3000;
  const std::size_t stride = input.world.points_W.size() / kMostDots + 1;
  for (std::size_t i = 0; i < input.world.points_W.size(); i += stride) {
    canvas.dot(from_above(input.world.points_W[i]), 1.5, kLandmark);
  }
  for (const sim::Segment& segment : input.world.segments_W) {
    canvas.line(from_above(segment.ends_W[0]), from_above(segment.ends_W[1]), kSegment);
  }
  const bool planes = input.scenario.world.type == sim::WorldType::kPlanes;
  for (const sim::Wall& wall : input.world.walls.walls) {
    planes ? draw_outline(canvas, wall) : draw_upright(canvas, wall);
  }
  for (std::size_t i = 1; i < path.size(); ++i) {
    canvas.line(from_above(path[i - 1]), from_above(path[i]),
                along_the_scale(static_cast<double>(i) / static_cast<double>(path.size())), 2);
  }
  canvas.ring(from_above(path.front()), 7.0, kStart);
  canvas.ring(from_above(path.back()), 7.0, kEnd);
  canvas.label(from_above(path.back()), "end", kEnd);
  canvas.label(from_above(path.front()), "start", kStart);
  canvas.legend("path, early", along_the_scale(0.0));
  canvas.legend("late", along_the_scale(1.0));
  canvas.legend(stride == 1 ? "landmarks" : fmt::format("landmarks, 1 of {}", stride), kLandmark);
  if (!input.world.segments_W.empty()) canvas.legend("segments", kSegment);
  if (!input.world.walls.walls.empty()) canvas.legend(planes ? "planes" : "walls", planes ? kPlane : kWall);
  canvas.write(file);
}

// Dark where a track is old: its observations up to now, of at most so many frames.
constexpr std::size_t kTailFrames = 12;
Colour colour_of_age(std::size_t observations) {
  return along_the_scale(1.0 - static_cast<double>(observations - 1) / kTailFrames);
}

// The segments of the last frame, and the ways of their middles through the others: ends slide, and say nothing.
void draw_lines(Canvas& canvas, std::span<const core::Frame> frames) {
  std::map<std::int64_t, std::vector<Eigen::Vector2d>> tails;
  for (const core::Frame& frame : frames) {
    for (const auto& line : frame.lines) tails[line.track_id].push_back(0.5 * (line.ends_px[0] + line.ends_px[1]));
  }
  for (const auto& line : frames.back().lines) {
    const std::vector<Eigen::Vector2d>& tail = tails.at(line.track_id);
    const Colour colour = colour_of_age(tail.size());
    for (std::size_t i = 1; i < tail.size(); ++i) canvas.line(tail[i - 1], tail[i], colour, 1);
    canvas.line(line.ends_px[0], line.ends_px[1], colour, 2);
    for (const Eigen::Vector2d& end : line.ends_px) canvas.dot(end, 2.5, colour);
  }
}

std::string tracks_text(const core::Frame& frame) {
  if (frame.lines.empty()) return fmt::format("{} tracks,", frame.points.size());
  return fmt::format("{} points and {} lines,", frame.points.size(), frame.lines.size());
}

void plot_frame(const std::string& file, const PlotInput& input) {
  const std::vector<core::Frame>& frames = input.simulation.measurements.frames;
  const auto& camera = input.scenario.camera.model;
  const Eigen::AlignedBox2d picture(Eigen::Vector2d(-0.5, -0.5),
                                    Eigen::Vector2d(camera.width_px - 0.5, camera.height_px - 0.5));
  const std::size_t now = frames.size() / 2;
  const std::size_t first = now - std::min(now, kTailFrames);

  std::map<std::int64_t, std::vector<Eigen::Vector2d>> tails;
  for (std::size_t i = first; i <= now; ++i) {
    for (const auto& point : frames[i].points) tails[point.track_id].push_back(point.pixel);
  }
  Canvas canvas(picture,
                fmt::format("{}: frame {} of {}, {} tails of {} frames", input.title, now + 1, frames.size(),
                            tracks_text(frames[now]), now - first),
                Canvas::VerticalAxis::kDown);
  canvas.draw_axes("u [px]", "v [px]");
  draw_lines(canvas, std::span(frames).subspan(first, now - first + 1));
  for (const auto& point : frames[now].points) {
    const std::vector<Eigen::Vector2d>& tail = tails.at(point.track_id);
    const Colour colour = colour_of_age(tail.size());
    for (std::size_t i = 1; i < tail.size(); ++i) canvas.line(tail[i - 1], tail[i], colour, 1);
    canvas.dot(point.pixel, 4.0, colour);
  }
  canvas.legend("just begun", along_the_scale(1.0));
  canvas.legend(fmt::format("seen in {} frames or more", kTailFrames + 1), along_the_scale(0.0));
  canvas.write(file);
}

}  // namespace

void write_plots(const std::filesystem::path& folder, const PlotInput& input) {
  std::filesystem::create_directories(folder);
  plot_trajectory((folder / "trajectory.png").string(), input);
  if (!input.simulation.measurements.frames.empty()) plot_frame((folder / "frame.png").string(), input);
}

}  // namespace plumbline::tools
