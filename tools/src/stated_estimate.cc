#include "tools/stated_estimate.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "core/config_tree.h"
#include "core/csv.h"
#include "core/dataset.h"
#include "core/error.h"
#include "core/physical_ranges.h"
#include "tools/trajectory_files.h"

namespace plumbline::tools {
namespace {

namespace fs = std::filesystem;
using core::ConfigTree;

constexpr double kLargestTdS = 3600.0;

double number_within(const ConfigTree& value, std::string_view key, double most) {
  double x = 0.0;
  const std::string& text = value.scalar;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), x);
  if (value.kind != ConfigTree::Kind::kScalar || error != std::errc() || end != text.data() + text.size() ||
      !std::isfinite(x)) {
    throw core::config_error(value.origin, key, "must be a number");
  }
  if (std::abs(x) > most) throw core::config_error(value.origin, key, fmt::format("must be within {}", most));
  return x;
}

// KEY or calibration.KEY.
const ConfigTree* find_calibrated(const ConfigTree& tree, std::string_view key) {
  const ConfigTree* value = core::find_value(tree, key);
  return value != nullptr ? value : core::find_value(tree, fmt::format("calibration.{}", key));
}

std::optional<double> calibrated_number(const ConfigTree& tree, std::string_view key) {
  const ConfigTree* value = find_calibrated(tree, key);
  return value != nullptr ? std::optional(number_within(*value, key, kLargestTdS)) : std::nullopt;
}

// The word's place among the names.
template <class Enum, std::size_t N>
std::optional<Enum> chosen(const ConfigTree& tree, std::string_view key, const std::array<std::string_view, N>& names) {
  const ConfigTree* value = core::find_value(tree, key);
  if (value == nullptr) return std::nullopt;
  const auto name = std::find(names.begin(), names.end(), value->scalar);
  if (name == names.end()) {
    throw core::config_error(value->origin, key, fmt::format("must be {}", fmt::join(names, ", ")));
  }
  return static_cast<Enum>(name - names.begin());
}

core::Pose parse_extrinsics(const ConfigTree& value) {
  core::Pose T;
  core::read_config(value, "T_B_C", T);
  if (std::abs(T.q.norm() - 1.0) > 1e-3) {
    throw core::config_error(value.origin, "T_B_C.quaternion_xyzw", "must be a unit quaternion");
  }
  T.q.normalize();
  return T;
}

// Row by row; what intrinsics have in it is left out, as they are.
core::PosteriorCovariance parse_covariance(const ConfigTree& value) {
  const auto count = static_cast<int>(value.items.size());
  const int dim = count == core::kCovDim * core::kCovDim ? core::kCovDim : core::kCovIntrinsics;
  if (count != dim * dim) {
    throw core::config_error(value.origin, "covariance",
                             fmt::format("must be a list of {0} x {0} numbers, row by row", core::kCovIntrinsics));
  }
  core::PosteriorCovariance P = core::PosteriorCovariance::Zero();
  for (int i = 0; i < count; ++i) {
    const double x =
        number_within(value.items[static_cast<std::size_t>(i)], "covariance", std::numeric_limits<double>::max());
    if (i / dim < core::kCovIntrinsics && i % dim < core::kCovIntrinsics) P(i / dim, i % dim) = x;
  }
  return P;
}

// td of the middle row, of which the log speaks.
double td_of_middle_row(const EstimateMeta& meta, double td_s) {
  return core::td_middle_from(td_s, meta.readout_s.value_or(0.0),
                              meta.td_reference_row.value_or(core::RowReference::kMiddle));
}

}  // namespace

EstimateMeta read_estimate_meta(const fs::path& file) {
  const ConfigTree tree = core::load_config_file(file);
  EstimateMeta meta;
  const ConfigTree* clock = core::find_value(tree, "stamp_clock");
  if (clock == nullptr) throw core::config_error(tree.origin, "stamp_clock", "missing: imu or camera");
  meta.stamp_clock = clock->scalar;
  if (meta.stamp_clock != "imu" && meta.stamp_clock != "camera") {
    throw core::config_error(clock->origin, "stamp_clock", "must be imu or camera");
  }
  meta.status = chosen<core::SolveStatus>(tree, "status", core::kSolveStatusNames).value_or(meta.status);
  if (const ConfigTree* reason = core::find_value(tree, "reason")) meta.reason = reason->scalar;
  meta.td_reference_row = chosen<core::RowReference>(tree, "td_reference_row", core::kRowReferenceNames);
  meta.td_s = calibrated_number(tree, "td_s");
  meta.readout_s = calibrated_number(tree, "readout_s");
  if (const ConfigTree* sigma = core::find_value(tree, "td_sigma_s")) {
    meta.td_sigma_s = number_within(*sigma, "td_sigma_s", kLargestTdS);
  }
  if (const ConfigTree* T_B_C = find_calibrated(tree, "T_B_C")) meta.T_B_C = parse_extrinsics(*T_B_C);
  if (const ConfigTree* P = core::find_value(tree, "covariance")) meta.covariance = parse_covariance(*P);
  if (meta.stamp_clock == "camera" && !meta.td_s) {
    throw core::config_error(clock->origin, "td_s", "missing: stamps of the camera's clock need the estimated td");
  }
  if (meta.td_reference_row == core::RowReference::kFirst && !meta.readout_s) {
    throw core::config_error(tree.origin, "readout_s", "missing: td of the first row needs it");
  }
  return meta;
}

std::vector<core::TimeOffsetEstimate> read_td_history(const fs::path& file, const EstimateMeta& meta) {
  std::vector<core::TimeOffsetEstimate> history;
  core::CsvReader csv(file, 2, 1);
  while (csv.next()) {
    core::TimeOffsetEstimate& at = history.emplace_back();
    at = {.t_ns = csv.integer(0),
          .td_s = td_of_middle_row(meta, csv.number(1)),
          .sigma_s = csv.has(2) ? csv.number(2) : 0.0};
    if (meta.stamp_clock == "camera") at.t_ns += core::to_ns(csv.number(1));
    if (history.size() > 1 && at.t_ns <= history[history.size() - 2].t_ns) csv.fail("stamps must increase");
  }
  return history;
}

StatedEstimate read_stated_estimate(const fs::path& folder) {
  const fs::path file = folder / "meta.yaml";
  const EstimateMeta meta = read_estimate_meta(file);
  if (meta.td_s && !meta.td_reference_row) {
    throw core::DataError(file.generic_string() +
                          ": td_reference_row: missing: the row that td_s is of, middle or first");
  }
  StatedEstimate stated{.log = {},
                        .td = meta.td_s.has_value(),
                        .readout = meta.readout_s.has_value(),
                        .extrinsics = meta.T_B_C.has_value()};
  core::EstimateLog& log = stated.log;
  log.status = meta.status;
  log.reason = meta.reason;
  if (log.status != core::SolveStatus::kConverged) return stated;

  const EstimatedTrajectory trajectory = read_estimate(folder);
  for (const core::StampedPose& pose : trajectory.poses) {
    log.states.push_back({pose.t_ns, {.T_W_B = pose.T_W_B, .v_W = Eigen::Vector3d::Zero(), .bias = {}}});
  }
  log.calibration = {.T_B_C = meta.T_B_C.value_or(core::Pose{}),
                     .td_s = meta.td_s ? td_of_middle_row(meta, *meta.td_s) : 0.0,
                     .readout_s = meta.readout_s.value_or(0.0)};
  core::PosteriorCovariance& P = log.covariance;
  if (meta.covariance) {
    P = *meta.covariance;
  } else {
    P(core::kCovTd, core::kCovTd) = std::pow(meta.td_sigma_s.value_or(0.0), 2);
    if (!trajectory.covariances.empty()) {
      P.block<6, 6>(core::kCovLastState, core::kCovLastState) = trajectory.covariances.back();
    }
  }
  log.td_estimated = stated.td && P(core::kCovTd, core::kCovTd) > 0.0;
  log.readout_estimated = stated.readout && P(core::kCovReadout, core::kCovReadout) > 0.0;
  log.extrinsics_estimated = stated.extrinsics && !P.topLeftCorner<6, 6>().isZero(0.0);
  if (stated.td) log.td_history = trajectory.td_history;
  return stated;
}

}  // namespace plumbline::tools
