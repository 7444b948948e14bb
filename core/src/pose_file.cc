#include "core/pose_file.h"

#include <array>
#include <cstdint>
#include <iterator>

#include <fmt/format.h>

#include "core/atomic_file.h"
#include "core/error.h"
#include "pose_text.h"

namespace plumbline::core {
namespace {

StampedPose parse_pose(std::string_view line, const std::string& where, const PoseFileOptions& options) {
  constexpr std::size_t kColumns = 8;
  std::array<std::string_view, kColumns> words;
  for (std::size_t i = 0; i < kColumns; ++i) {
    words[i] = pose_text::take_word(line);
    if (words[i].empty()) {
      throw DataError(fmt::format("{}: a pose needs 8 columns (t tx ty tz qx qy qz qw), not {}", where, i));
    }
  }
  const TimeNs t_ns = pose_text::parse_seconds(words[0], where);
  std::array<double, kColumns> v{};
  for (std::size_t i = 1; i < kColumns; ++i) v[i] = pose_text::parse_number(words[i], where, options.allow_unusable);
  return {t_ns, {pose_text::unit_quaternion({v[7], v[4], v[5], v[6]}, where), {v[1], v[2], v[3]}}};
}

void append_stamp(fmt::memory_buffer& out, TimeNs t_ns) {
  const auto bits = static_cast<std::uint64_t>(t_ns);
  const std::uint64_t magnitude = t_ns < 0 ? 0U - bits : bits;
  constexpr std::uint64_t kSecond = kNsPerSecond;
  fmt::format_to(std::back_inserter(out), "{}{}.{:09}", t_ns < 0 ? "-" : "", magnitude / kSecond, magnitude % kSecond);
}

}  // namespace

std::vector<StampedPose> parse_tum(std::string_view text, const std::string& name, const PoseFileOptions& options) {
  pose_text::refuse_binary(text, name);
  std::vector<StampedPose> poses;
  pose_text::Lines lines(text, name);
  while (const auto line = lines.next()) {
    const StampedPose pose = parse_pose(*line, lines.where(), options);
    if (!poses.empty() && !options.allow_unusable) {
      pose_text::require_later(pose.t_ns, poses.back().t_ns, lines.where());
    }
    poses.push_back(pose);
  }
  if (poses.empty()) throw DataError(name + ": no poses");
  return poses;
}

std::vector<StampedPose> read_tum(const std::filesystem::path& path, const PoseFileOptions& options) {
  return parse_tum(pose_text::read_file(path), path.string(), options);
}

void write_tum(const std::filesystem::path& path, const std::vector<StampedPose>& poses) {
  fmt::memory_buffer out;
  for (const auto& [t_ns, T] : poses) {
    append_stamp(out, t_ns);
    fmt::format_to(std::back_inserter(out), " {} {} {} {} {} {} {}\n", T.p.x(), T.p.y(), T.p.z(), T.q.x(), T.q.y(),
                   T.q.z(), T.q.w());
  }
  write_file_atomically(path, {out.data(), out.size()});
}

}  // namespace plumbline::core
