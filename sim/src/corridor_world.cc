#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <set>
#include <utility>

#include "sim/wall_landmarks.h"
#include "sim/world.h"

namespace plumbline::sim {
namespace {

using Cell = std::array<int, 2>;  // cell (i, j) holds [i, i + 1) x [j, j + 1) of the grid

// Grid coordinates to the world's: x = R (side_m g + shift_m).
struct Grid {
  double side_m = 1.0;
  Eigen::Rotation2Dd R{0.0};
  Eigen::Vector2d shift_m = Eigen::Vector2d::Zero();

  Eigen::Vector2d world(double i, double j) const { return R * (side_m * Eigen::Vector2d(i, j) + shift_m); }
};

// All cells that are nearer to a point than the clearance, which is at most half a side.
std::set<Cell> cells_of(const Grid& grid, double clearance_m, const std::vector<Eigen::Vector2d>& points) {
  std::set<Cell> cells;
  const Eigen::Matrix2d to_grid = grid.R.inverse().toRotationMatrix();
  for (const Eigen::Vector2d& point : points) {
    const Eigen::Vector2d p = to_grid * point - grid.shift_m;
    for (const double dx : {-clearance_m, clearance_m}) {
      for (const double dy : {-clearance_m, clearance_m}) {
        cells.insert({static_cast<int>(std::floor((p.x() + dx) / grid.side_m)),
                      static_cast<int>(std::floor((p.y() + dy) / grid.side_m))});
      }
    }
  }
  return cells;
}

// The points without those nearer than spacing_m to the last one kept: enough to compare grids by.
std::vector<Eigen::Vector2d> thinned(const std::vector<Eigen::Vector2d>& points, double spacing_m) {
  std::vector<Eigen::Vector2d> kept;
  for (const Eigen::Vector2d& point : points) {
    if (kept.empty() || (point - kept.back()).norm() > spacing_m) kept.push_back(point);
  }
  return kept;
}

// The grid with the fewest cells, of several directions and shifts.
Grid best_grid(double side_m, double clearance_m, const std::vector<Eigen::Vector2d>& points) {
  constexpr int kDirections = 18;
  constexpr int kShifts = 4;
  const std::vector<Eigen::Vector2d> few = thinned(points, 0.25 * side_m);
  Grid best{.side_m = side_m};
  std::size_t fewest = cells_of(best, clearance_m, few).size();
  for (int k = 0; k < kDirections; ++k) {
    for (int i = 0; i < kShifts * kShifts; ++i) {
      const Grid grid{.side_m = side_m,
                      .R = Eigen::Rotation2Dd(0.5 * std::numbers::pi * k / kDirections),
                      .shift_m = side_m / kShifts * Eigen::Vector2d(i / kShifts, i % kShifts)};
      const std::size_t n = cells_of(grid, clearance_m, few).size();
      if (n >= fewest) continue;
      fewest = n;
      best = grid;
    }
  }
  return best;
}

// Cells first..last of a line, neighbours along an axis.
struct Run {
  int line;
  int first;
  int last;
};

template <class Wanted>
std::vector<Run> runs_along(std::size_t axis, const std::set<Cell>& cells, const Wanted& wanted) {
  std::vector<std::array<int, 2>> places;
  for (const Cell& cell : cells) {
    if (wanted(cell)) places.push_back({cell[1 - axis], cell[axis]});
  }
  std::sort(places.begin(), places.end());
  std::vector<Run> runs;
  for (const auto& [line, place] : places) {
    if (!runs.empty() && runs.back().line == line && runs.back().last + 1 == place) {
      ++runs.back().last;
    } else {
      runs.push_back({line, place, place});
    }
  }
  return runs;
}

// The walls between cells and what is no cell, seen from the cells.
std::vector<Wall> walls_about(const std::set<Cell>& cells, const Grid& grid, double bottom_z, double top_z) {
  std::vector<Wall> walls;
  const auto build = [&](const Eigen::Vector2d& from, const Eigen::Vector2d& to) {
    walls.push_back(upright_wall(from, to, bottom_z, top_z));
  };
  const auto open_towards = [&](int di, int dj) {
    return [&cells, di, dj](const Cell& cell) { return !cells.contains({cell[0] + di, cell[1] + dj}); };
  };
  for (const Run& r : runs_along(1, cells, open_towards(-1, 0))) {
    build(grid.world(r.line, r.first), grid.world(r.line, r.last + 1));
  }
  for (const Run& r : runs_along(1, cells, open_towards(1, 0))) {
    build(grid.world(r.line + 1, r.last + 1), grid.world(r.line + 1, r.first));
  }
  for (const Run& r : runs_along(0, cells, open_towards(0, 1))) {
    build(grid.world(r.first, r.line + 1), grid.world(r.last + 1, r.line + 1));
  }
  for (const Run& r : runs_along(0, cells, open_towards(0, -1))) {
    build(grid.world(r.last + 1, r.line), grid.world(r.first, r.line));
  }
  return walls;
}

}  // namespace

World corridor_world(const ScenarioConfig& scenario, const Trajectory& trajectory, core::TrialId id) {
  const WorldConfig& config = scenario.world;
  std::vector<Eigen::Vector2d> points;
  Eigen::AlignedBox1d height;
  for (const Eigen::Vector3d& p : sample_path(scenario, trajectory).all()) {
    points.emplace_back(p.head<2>());
    height.extend(p.tail<1>());
  }
  const double bottom_z = height.min().value() - config.walls.floor_below_m;
  const double top_z = height.max().value() + config.walls.ceiling_above_m;
  const Grid grid = best_grid(config.corridor.width_m, config.walls.clearance_m, points);
  const std::set<Cell> cells = cells_of(grid, config.walls.clearance_m, points);

  World world{
      .points_W = {}, .walls = {walls_about(cells, grid, bottom_z, top_z)}, .walls_hide = config.walls.occlusion};
  std::vector<Wall> faces = world.walls.walls;
  for (const Run& r : runs_along(0, cells, [](const Cell&) { return true; })) {
    const Eigen::Vector2d corner = grid.world(r.first, r.line);
    const Eigen::Vector2d u = grid.world(r.last + 1, r.line) - corner;
    const Eigen::Vector2d v = grid.world(r.first, r.line + 1) - corner;
    faces.push_back(level_face(corner, u, v, bottom_z));
    faces.push_back(turned_round(level_face(corner, u, v, top_z)));
  }
  world.points_W = scatter_on(faces, config.landmarks, core::RandomStream(id.shared(), "world/corridor"));
  world.faces = std::move(faces);
  return world;
}

}  // namespace plumbline::sim
