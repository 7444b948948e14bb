#include "core/pose_formats.h"

#include <algorithm>
#include <charconv>
#include <cmath>

#include <fmt/format.h>

#include "core/error.h"
#include "pose_text.h"

namespace plumbline::core {
namespace {

constexpr std::size_t kKittiColumns = 12;

std::size_t count_words(std::string_view line) {
  std::size_t n = 0;
  while (!pose_text::take_word(line).empty()) ++n;
  return n;
}

PoseFormat format_of(std::string_view text, const std::string& name) {
  const auto line = pose_text::Lines(text, name).next();
  if (!line) throw DataError(name + ": no poses");
  if (line->find(',') != std::string_view::npos) return PoseFormat::kEuroc;
  return count_words(*line) == kKittiColumns && !name.ends_with(".tum") ? PoseFormat::kKitti : PoseFormat::kTum;
}

// The fields of a line, blanks about them taken off; a comma at its end begins no further one.
std::vector<std::string_view> split_at_commas(std::string_view line) {
  std::vector<std::string_view> fields;
  while (!line.empty()) {
    const std::size_t comma = std::min(line.find(','), line.size());
    std::string_view field = line.substr(0, comma);
    line.remove_prefix(std::min(comma + 1, line.size()));
    const bool end_of_line = line.empty() && count_words(field) == 0;
    if (!end_of_line) fields.push_back(pose_text::take_word(field));
  }
  return fields;
}

StampedPose parse_euroc(std::string_view line, const std::string& where, bool allow_unusable) {
  constexpr std::size_t kColumns = 8;
  const std::vector<std::string_view> fields = split_at_commas(line);
  if (fields.size() < kColumns) {
    throw DataError(
        fmt::format("{}: a pose needs 8 columns (t_ns,px,py,pz,qw,qx,qy,qz), not {}", where, fields.size()));
  }
  TimeNs t_ns = 0;
  const auto [end, error] = std::from_chars(fields[0].data(), fields[0].data() + fields[0].size(), t_ns);
  if (error != std::errc() || end != fields[0].data() + fields[0].size()) {
    throw DataError(fmt::format("{}: the stamp '{}' is not integer nanoseconds", where, fields[0]));
  }
  const auto number = [&](std::size_t column) {
    return pose_text::parse_number(fields[column], where, allow_unusable);
  };
  return {t_ns,
          {pose_text::unit_quaternion({number(4), number(5), number(6), number(7)}, where),
           {number(1), number(2), number(3)}}};
}

// The axes of a camera (x right, y down, z forward) to those of a body (x forward, y left, z up).
Eigen::Matrix3d body_from_camera_axes() {
  Eigen::Matrix3d M;
  M << 0, 0, 1,  //
      -1, 0, 0,  //
      0, -1, 0;
  return M;
}

Pose parse_kitti(std::string_view line, const std::string& where) {
  const std::size_t columns = count_words(line);
  if (columns != kKittiColumns) {
    throw DataError(fmt::format("{}: a KITTI pose has 12 numbers, the rows of [R t], not {}", where, columns));
  }
  Eigen::Matrix<double, 3, 4, Eigen::RowMajor> T;
  for (int i = 0; i < T.size(); ++i) T.data()[i] = pose_text::parse_number(pose_text::take_word(line), where);
  const Eigen::Matrix3d R = T.leftCols<3>();
  constexpr double kMaxError = 1e-3;
  const double error = (R * R.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  if (error > kMaxError || R.determinant() < 0.0) {
    throw DataError(
        fmt::format("{}: its left 3 columns are not a rotation: R R^T is off the identity by {:.3g}, "
                    "its determinant {:.3g}",
                    where, error, R.determinant()));
  }
  const Eigen::Matrix3d M = body_from_camera_axes();
  return {Eigen::Quaterniond(M * R * M.transpose()).normalized(), M * T.col(3)};
}

std::vector<StampedPose> parse_rows(std::string_view text, const std::string& name, PoseFormat format,
                                    const PoseFormatOptions& options) {
  if (format == PoseFormat::kKitti && options.kitti_rate_hz <= 0.0) {
    throw DataError(name + ": a KITTI file has no stamps; scenario.trajectory.pose_rate_hz must give their rate");
  }
  std::vector<StampedPose> poses;
  pose_text::Lines lines(text, name);
  while (const auto line = lines.next()) {
    if (format == PoseFormat::kEuroc) {
      poses.push_back(parse_euroc(*line, lines.where(), options.allow_unusable));
      if (poses.size() > 1 && !options.allow_unusable) {
        pose_text::require_later(poses.back().t_ns, poses[poses.size() - 2].t_ns, lines.where());
      }
    } else {
      poses.push_back(
          {to_ns(static_cast<double>(poses.size()) / options.kitti_rate_hz), parse_kitti(*line, lines.where())});
    }
  }
  if (poses.empty()) throw DataError(name + ": no poses");
  return poses;
}

}  // namespace

PoseFile parse_poses(std::string_view text, const std::string& name, const PoseFormatOptions& options) {
  pose_text::refuse_binary(text, name);
  const PoseFormat format = options.format == PoseFormat::kAuto ? format_of(text, name) : options.format;
  if (format == PoseFormat::kTum) return {parse_tum(text, name, {options.allow_unusable}), format};
  return {parse_rows(text, name, format, options), format};
}

PoseFile read_poses(const std::filesystem::path& path, const PoseFormatOptions& options) {
  return parse_poses(pose_text::read_file(path), path.string(), options);
}

}  // namespace plumbline::core
