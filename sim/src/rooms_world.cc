#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "core/error.h"
#include "sim/wall_landmarks.h"
#include "sim/world.h"

namespace plumbline::sim {
namespace {

// Coordinates between lo and hi that divide it into nearly equal parts no longer than longest_m. Each is moved by up
// to a quarter of a part, to where the fewest coordinates of the path are within the clearance.
std::vector<double> divisions(double lo, double hi, double longest_m, double clearance_m,
                              const std::vector<double>& path) {
  constexpr int kPlaces = 10;
  const int parts = static_cast<int>(std::ceil((hi - lo) / longest_m));
  const double part_m = (hi - lo) / parts;
  const auto near = [&](double x) {
    return std::count_if(path.begin(), path.end(), [&](double p) { return std::abs(p - x) < clearance_m; });
  };
  std::vector<double> result;
  for (int i = 1; i < parts; ++i) {
    const double nominal = lo + i * part_m;
    double best = nominal;
    for (int k = 1; k <= kPlaces; ++k) {
      for (const double side : {1.0, -1.0}) {
        const double x = nominal + side * 0.25 * part_m * k / kPlaces;
        if (near(x) < near(best)) best = x;
      }
    }
    result.push_back(best);
  }
  return result;
}

// A door wherever the path comes nearer to the wall than the clearance, wide and high enough for it; elsewhere, if it
// comes nowhere, one at the share `where` of the wall's length.
std::vector<Eigen::AlignedBox2d> doors(const Wall& wall, const std::vector<Eigen::Vector3d>& path_W,
                                       const WorldConfig& config, double where) {
  const double clearance_m = config.walls.clearance_m;
  const double half_width_m = std::max(0.5 * config.rooms.door_width_m, clearance_m);
  std::vector<Eigen::Vector2d> passages;
  for (const Eigen::Vector3d& p : path_W) {
    const Eigen::Vector3d d = p - wall.corner_W;
    const Eigen::Vector2d ab(d.dot(wall.u_W), d.dot(wall.v_W));
    const bool near = std::abs(d.dot(wall.normal_W())) < clearance_m && ab.x() > -clearance_m &&
                      ab.x() < wall.size_m.x() + clearance_m;
    if (near) passages.push_back(ab);
  }
  if (passages.empty()) {
    const double a = half_width_m + where * std::max(wall.size_m.x() - 2.0 * half_width_m, 0.0);
    passages.emplace_back(a, 0.0);
  }
  std::sort(passages.begin(), passages.end(), [](const auto& p, const auto& q) { return p.x() < q.x(); });

  const double least_height_m = std::min(config.rooms.door_height_m, wall.size_m.y());
  std::vector<Eigen::AlignedBox2d> openings;
  for (const Eigen::Vector2d& ab : passages) {
    const double left = std::max(ab.x() - half_width_m, 0.0);
    const Eigen::Vector2d upper_right(std::min(ab.x() + half_width_m, wall.size_m.x()),
                                      std::max(least_height_m, ab.y() + clearance_m));
    if (openings.empty() || left > openings.back().max().x()) {
      openings.emplace_back(Eigen::Vector2d(left, 0.0), upper_right);
    } else {
      openings.back().extend(upper_right);
    }
  }
  return openings;
}

// The outline of the house, the coordinates of its inner walls, floor and ceiling.
struct House {
  Eigen::AlignedBox3d box;
  std::vector<double> x;  // of the walls across x, the outer ones included
  std::vector<double> y;
};

// Each room costs a wall or two, and each landmark is asked of each wall.
void require_few_rooms(const House& house, double longest_side_m) {
  constexpr double kMostRooms = 1000.0;
  const Eigen::Vector3d size_m = house.box.sizes();
  const double rooms = std::ceil(size_m.x() / longest_side_m) * std::ceil(size_m.y() / longest_side_m);
  if (rooms <= kMostRooms) return;
  throw core::RuleError(
      {"scenario.world.rooms.longest_side_m",
       fmt::format("must be larger, or the margin and the path smaller: {} m divide a house of {:.0f} m x {:.0f} m "
                   "into {} rooms, at most {} are built",
                   longest_side_m, size_m.x(), size_m.y(), rooms, kMostRooms)});
}

House house_about(const std::vector<Eigen::Vector3d>& path_W, const WorldConfig& config) {
  House house;
  for (const Eigen::Vector3d& p : path_W) house.box.extend(p);
  const double margin_m = std::max(config.rooms.margin_m, config.walls.clearance_m);
  house.box.min() -= Eigen::Vector3d(margin_m, margin_m, config.walls.floor_below_m);
  house.box.max() += Eigen::Vector3d(margin_m, margin_m, config.walls.ceiling_above_m);
  require_few_rooms(house, config.rooms.longest_side_m);
  for (const int axis : {0, 1}) {
    std::vector<double> coordinates;
    coordinates.reserve(path_W.size());
    for (const Eigen::Vector3d& p : path_W) coordinates.push_back(p[axis]);
    std::vector<double>& walls = axis == 0 ? house.x : house.y;
    walls = divisions(house.box.min()[axis], house.box.max()[axis], config.rooms.longest_side_m,
                      config.walls.clearance_m, coordinates);
    walls.insert(walls.begin(), house.box.min()[axis]);
    walls.push_back(house.box.max()[axis]);
  }
  return house;
}

}  // namespace

World rooms_world(const ScenarioConfig& scenario, const Trajectory& trajectory, core::TrialId id) {
  const WorldConfig& config = scenario.world;
  const core::RandomStream stream(id.shared(), "world/doors");
  const std::vector<Eigen::Vector3d> path_W = sample_path(scenario, trajectory).all();
  const House house = house_about(path_W, config);
  const double bottom_z = house.box.min().z();
  const double top_z = house.box.max().z();

  World world{.points_W = {}, .walls = {}, .walls_hide = config.walls.occlusion};
  std::vector<Wall> faces;
  const auto build = [&](const Eigen::Vector2d& from, const Eigen::Vector2d& to, bool between_rooms) {
    Wall wall = upright_wall(from, to, bottom_z, top_z);
    if (between_rooms) {
      wall.openings = doors(wall, path_W, config, stream.uniform(world.walls.walls.size()));
      faces.push_back(turned_round(wall));
    }
    faces.push_back(wall);
    world.walls.walls.push_back(std::move(wall));
  };
  const double x0 = house.x.front();
  const double x1 = house.x.back();
  const double y0 = house.y.front();
  const double y1 = house.y.back();
  build({x0, y0}, {x0, y1}, false);
  build({x0, y1}, {x1, y1}, false);
  build({x1, y1}, {x1, y0}, false);
  build({x1, y0}, {x0, y0}, false);
  for (std::size_t i = 1; i + 1 < house.x.size(); ++i) {
    for (std::size_t j = 1; j < house.y.size(); ++j) {
      build({house.x[i], house.y[j - 1]}, {house.x[i], house.y[j]}, true);
    }
  }
  for (std::size_t j = 1; j + 1 < house.y.size(); ++j) {
    for (std::size_t i = 1; i < house.x.size(); ++i) {
      build({house.x[i - 1], house.y[j]}, {house.x[i], house.y[j]}, true);
    }
  }

  faces.push_back(level_face({x0, y0}, {x1 - x0, 0.0}, {0.0, y1 - y0}, bottom_z));
  faces.push_back(turned_round(level_face({x0, y0}, {x1 - x0, 0.0}, {0.0, y1 - y0}, top_z)));
  world.points_W = scatter_on(faces, config.landmarks, core::RandomStream(id.shared(), "world/rooms"));
  world.faces = std::move(faces);
  return world;
}

}  // namespace plumbline::sim
