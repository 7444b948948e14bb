#include "eval/series.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include <nlohmann/json.hpp>

namespace plumbline::eval {
namespace {

using nlohmann::ordered_json;

// One array for each of the `rows` components that `at(point)` gives.
template <class Point, class At>
ordered_json columns(const std::vector<Point>& points, int rows, const At& at) {
  ordered_json json = ordered_json::array();
  for (int row = 0; row < rows; ++row) {
    ordered_json column = ordered_json::array();
    for (const Point& point : points) column.push_back(at(point)(row));
    json.push_back(std::move(column));
  }
  return json;
}

template <class Point>
ordered_json column(const std::vector<Point>& points, double Point::* member) {
  ordered_json json = ordered_json::array();
  for (const Point& point : points) json.push_back(point.*member);
  return json;
}

Eigen::Matrix<double, 7, 1> coefficients(const core::Pose& T) {
  Eigen::Matrix<double, 7, 1> c;
  c << T.p, T.q.coeffs();  // x, y, z, w
  return c;
}

}  // namespace

std::vector<int> grid_indices(const std::vector<core::TimeNs>& stamps, int points) {
  std::vector<int> indices;
  if (stamps.empty()) return indices;
  const double span_s = core::to_seconds(stamps.back() - stamps.front());
  std::size_t i = 0;
  for (int k = 0; k < points; ++k) {
    const core::TimeNs t = stamps.front() + (points > 1 ? core::to_ns(span_s * k / (points - 1)) : 0);
    while (i + 1 < stamps.size() && std::abs(stamps[i + 1] - t) <= std::abs(stamps[i] - t)) ++i;
    if (indices.empty() || indices.back() != static_cast<int>(i)) indices.push_back(static_cast<int>(i));
  }
  return indices;
}

Series make_series(const std::vector<PosePair>& pairs, const TrajectoryErrors& errors,
                   const std::vector<core::TimeOffsetEstimate>& td_history, double td_s) {
  const core::TimeNs start = pairs.front().t_ns;
  Series series;
  std::vector<core::TimeNs> stamps;
  stamps.reserve(pairs.size());
  for (const PosePair& pair : pairs) stamps.push_back(pair.t_ns);
  for (const int k : grid_indices(stamps)) {
    series.points.push_back({.t_s = core::to_seconds(pairs[k].t_ns - start),
                             .error = errors.errors[k],
                             .aligned = errors.truth_from_estimate * pairs[k].estimate,
                             .truth = pairs[k].truth});
  }
  stamps.clear();
  for (const core::TimeOffsetEstimate& estimate : td_history) stamps.push_back(estimate.t_ns);
  for (const int k : grid_indices(stamps)) {
    series.td.push_back({.t_s = core::to_seconds(td_history[k].t_ns - start),
                         .td_error_s = td_history[k].td_s - td_s,
                         .sigma_s = td_history[k].sigma_s});
  }
  return series;
}

ordered_json to_json(const Series& series) {
  ordered_json json;
  json["t_s"] = column(series.points, &SeriesPoint::t_s);
  json["position_error_m"] = columns(series.points, 3, [](const auto& p) { return p.error.position_m; });
  json["rotation_error_rad"] = columns(series.points, 3, [](const auto& p) { return p.error.rotation_rad; });
  json["estimate"] = columns(series.points, 7, [](const auto& p) { return coefficients(p.aligned); });
  json["truth"] = columns(series.points, 7, [](const auto& p) { return coefficients(p.truth); });
  if (!series.td.empty()) {
    json["td"] = {{"t_s", column(series.td, &TimeOffsetPoint::t_s)},
                  {"td_error_s", column(series.td, &TimeOffsetPoint::td_error_s)},
                  {"sigma_s", column(series.td, &TimeOffsetPoint::sigma_s)}};
  }
  if (!series.online.empty()) {
    const auto t_s = column(series.online, &OnlinePoint::t_s);
    json["sigma"] = {
        {"t_s", t_s},
        {"position_m", columns(series.online, 3, [](const auto& p) { return p.position_sigma_m; })},
        {"rotation_rad", columns(series.online, 3, [](const auto& p) { return p.orientation_sigma_rad; })}};
    json["nees"] = {{"t_s", t_s},
                    {"position", column(series.online, &OnlinePoint::position_nees)},
                    {"orientation", column(series.online, &OnlinePoint::orientation_nees)},
                    {"pose", column(series.online, &OnlinePoint::pose_nees)},
                    {"velocity", column(series.online, &OnlinePoint::velocity_nees)},
                    {"bias", column(series.online, &OnlinePoint::bias_nees)}};
  }
  if (!series.bound.empty()) {
    json["bound"] = {{"t_s", column(series.bound, &BoundPoint::t_s)},
                     {"td_s", column(series.bound, &BoundPoint::td_s)},
                     {"readout_s", column(series.bound, &BoundPoint::readout_s)},
                     {"position_m", column(series.bound, &BoundPoint::position_m)},
                     {"orientation_rad", column(series.bound, &BoundPoint::orientation_rad)},
                     {"position_in_the_end_m", column(series.bound, &BoundPoint::position_in_the_end_m)},
                     {"orientation_in_the_end_rad", column(series.bound, &BoundPoint::orientation_in_the_end_rad)}};
  }
  return json;
}

}  // namespace plumbline::eval
