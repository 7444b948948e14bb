#include "core/pose_file.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <iterator>
#include <limits>
#include <optional>
#include <system_error>

#include <fmt/format.h>

#include "core/atomic_file.h"
#include "core/error.h"

namespace plumbline::core {
namespace {

constexpr int kColumns = 8;
constexpr double kMaxNormError = 1e-3;
constexpr std::string_view kBlank = " \t\r\v\f";

// The next word of `line`, which is cut off it; empty at the end.
std::string_view take_word(std::string_view& line) {
  const std::size_t first = std::min(line.find_first_not_of(kBlank), line.size());
  line.remove_prefix(first);
  const std::string_view word = line.substr(0, line.find_first_of(kBlank));
  line.remove_prefix(word.size());
  return word;
}

bool is_digit(char c) { return c >= '0' && c <= '9'; }

// A decimal number without its sign: value = 0.DIGITS * 10^point.
struct Decimal {
  std::string digits;
  int point = 0;
};

std::optional<Decimal> parse_decimal(std::string_view text) {
  Decimal decimal;
  std::size_t i = 0;
  for (; i < text.size() && is_digit(text[i]); ++i) decimal.digits += text[i];
  decimal.point = static_cast<int>(i);
  if (i < text.size() && text[i] == '.') {
    for (++i; i < text.size() && is_digit(text[i]); ++i) decimal.digits += text[i];
  }
  if (decimal.digits.empty()) return std::nullopt;
  if (i < text.size() && (text[i] == 'e' || text[i] == 'E')) {
    ++i;
    if (i < text.size() && text[i] == '+') ++i;
    int exponent = 0;
    const auto [end, error] = std::from_chars(text.data() + i, text.data() + text.size(), exponent);
    if (error != std::errc() || std::abs(exponent) > 400) return std::nullopt;
    i = static_cast<std::size_t>(end - text.data());
    decimal.point += exponent;
  }
  if (i != text.size()) return std::nullopt;
  return decimal;
}

TimeNs parse_stamp(std::string_view word, const std::string& where) {
  const bool negative = word.starts_with('-');
  const bool has_sign = negative || word.starts_with('+');
  const auto decimal = parse_decimal(word.substr(has_sign ? 1 : 0));
  if (!decimal) throw DataError(fmt::format("{}: the stamp '{}' is not a number", where, word));

  constexpr auto kMax = static_cast<std::uint64_t>(std::numeric_limits<TimeNs>::max());
  const int whole = decimal->point + 9;  // digits that make the integer nanoseconds
  const auto digit = [&](int i) {
    return i >= 0 && i < std::ssize(decimal->digits) ? static_cast<std::uint64_t>(decimal->digits[i] - '0') : 0U;
  };
  std::uint64_t ns = 0;
  for (int i = 0; i <= whole; ++i) {
    const bool last = i == whole;
    const std::uint64_t next = last ? (digit(i) >= 5 ? 1U : 0U) : digit(i);
    if (ns > (kMax - next) / (last ? 1U : 10U)) {
      throw DataError(fmt::format("{}: the stamp '{}' is too large for integer nanoseconds", where, word));
    }
    ns = ns * (last ? 1U : 10U) + next;
  }
  return negative ? -static_cast<TimeNs>(ns) : static_cast<TimeNs>(ns);
}

double parse_value(std::string_view word, const std::string& where, const PoseFileOptions& options) {
  double value = 0.0;
  const std::string_view digits = word.substr(word.starts_with('+') ? 1 : 0);
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  if (error == std::errc::result_out_of_range) {
    throw DataError(fmt::format("{}: '{}' is outside the range of a double", where, word));
  }
  if (error != std::errc() || end != digits.data() + digits.size()) {
    throw DataError(fmt::format("{}: '{}' is not a number", where, word));
  }
  if (!std::isfinite(value) && !options.allow_unusable) {
    throw DataError(fmt::format("{}: '{}' is not finite", where, word));
  }
  return value;
}

StampedPose parse_pose(std::string_view line, const std::string& where, const PoseFileOptions& options) {
  std::array<std::string_view, kColumns> words;
  for (int i = 0; i < kColumns; ++i) {
    words[i] = take_word(line);
    if (words[i].empty()) {
      throw DataError(fmt::format("{}: a pose needs 8 columns (t tx ty tz qx qy qz qw), not {}", where, i));
    }
  }
  StampedPose pose;
  pose.t_ns = parse_stamp(words[0], where);
  std::array<double, kColumns> v{};
  for (int i = 1; i < kColumns; ++i) v[i] = parse_value(words[i], where, options);
  pose.T_W_B.p = {v[1], v[2], v[3]};
  pose.T_W_B.q = Eigen::Quaterniond(v[7], v[4], v[5], v[6]);
  if (!pose.T_W_B.q.coeffs().allFinite()) return pose;
  const double norm = pose.T_W_B.q.norm();
  if (std::abs(norm - 1.0) > kMaxNormError) {
    throw DataError(fmt::format("{}: the quaternion's norm is {:.6g}, not 1 (to {})", where, norm, kMaxNormError));
  }
  pose.T_W_B.q.coeffs() /= norm;
  return pose;
}

void append_stamp(fmt::memory_buffer& out, TimeNs t_ns) {
  const auto bits = static_cast<std::uint64_t>(t_ns);
  const std::uint64_t magnitude = t_ns < 0 ? 0U - bits : bits;
  constexpr std::uint64_t kSecond = kNsPerSecond;
  fmt::format_to(std::back_inserter(out), "{}{}.{:09}", t_ns < 0 ? "-" : "", magnitude / kSecond, magnitude % kSecond);
}

}  // namespace

std::vector<StampedPose> parse_tum(std::string_view text, const std::string& name, const PoseFileOptions& options) {
  if (text.find('\0') != std::string_view::npos) throw DataError(name + ": a binary file, not a list of poses");
  std::vector<StampedPose> poses;
  for (int number = 1; !text.empty(); ++number) {
    std::string_view line = text.substr(0, text.find('\n'));
    text.remove_prefix(std::min(line.size() + 1, text.size()));
    const std::size_t first = line.find_first_not_of(kBlank);
    if (first == std::string_view::npos || line[first] == '#') continue;

    const std::string where = fmt::format("{}:{}", name, number);
    const StampedPose pose = parse_pose(line, where, options);
    if (!poses.empty() && !options.allow_unusable && pose.t_ns <= poses.back().t_ns) {
      const bool duplicate = pose.t_ns == poses.back().t_ns;
      throw DataError(fmt::format("{}: stamps must increase: this one is {} the one before", where,
                                  duplicate ? "a duplicate of" : "unsorted, earlier than"));
    }
    poses.push_back(pose);
  }
  if (poses.empty()) throw DataError(name + ": no poses");
  return poses;
}

std::vector<StampedPose> read_tum(const std::filesystem::path& path, const PoseFileOptions& options) {
  std::error_code none;
  if (!std::filesystem::exists(path, none)) throw DataError(path.string() + ": no such file");
  if (std::filesystem::is_directory(path, none)) throw DataError(path.string() + ": a folder, not a file of poses");
  std::ifstream file(path, std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  if (!file) throw DataError(path.string() + ": cannot be read");
  return parse_tum(text, path.string(), options);
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
