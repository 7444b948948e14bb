#include "pose_text.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <iterator>
#include <limits>
#include <system_error>

#include <fmt/format.h>

#include "core/error.h"

namespace plumbline::core::pose_text {
namespace {

constexpr double kMaxNormError = 1e-3;
constexpr std::string_view kBlank = " \t\r\v\f";

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

}  // namespace

std::string read_file(const std::filesystem::path& path) {
  std::error_code none;
  if (!std::filesystem::exists(path, none)) throw DataError(path.string() + ": no such file");
  if (std::filesystem::is_directory(path, none)) throw DataError(path.string() + ": a folder, not a file of poses");
  std::ifstream file(path, std::ios::binary);
  std::string text{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  if (!file) throw DataError(path.string() + ": cannot be read");
  return text;
}

void refuse_binary(std::string_view text, const std::string& name) {
  if (text.find('\0') != std::string_view::npos) throw DataError(name + ": a binary file, not a list of poses");
}

std::optional<std::string_view> Lines::next() {
  while (!rest_.empty()) {
    ++number_;
    const std::string_view line = rest_.substr(0, rest_.find('\n'));
    rest_.remove_prefix(std::min(line.size() + 1, rest_.size()));
    const std::size_t first = line.find_first_not_of(kBlank);
    if (first != std::string_view::npos && line[first] != '#') return line;
  }
  return std::nullopt;
}

std::string Lines::where() const { return fmt::format("{}:{}", name_, number_); }

std::string_view take_word(std::string_view& line) {
  const std::size_t first = std::min(line.find_first_not_of(kBlank), line.size());
  line.remove_prefix(first);
  const std::string_view word = line.substr(0, line.find_first_of(kBlank));
  line.remove_prefix(word.size());
  return word;
}

TimeNs parse_seconds(std::string_view word, const std::string& where) {
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

double parse_number(std::string_view word, const std::string& where, bool allow_non_finite) {
  double value = 0.0;
  const std::string_view digits = word.substr(word.starts_with('+') ? 1 : 0);
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  if (error == std::errc::result_out_of_range) {
    throw DataError(fmt::format("{}: '{}' is outside the range of a double", where, word));
  }
  if (error != std::errc() || end != digits.data() + digits.size()) {
    throw DataError(fmt::format("{}: '{}' is not a number", where, word));
  }
  if (!std::isfinite(value) && !allow_non_finite) {
    throw DataError(fmt::format("{}: '{}' is not finite", where, word));
  }
  return value;
}

Eigen::Quaterniond unit_quaternion(const Eigen::Quaterniond& q, const std::string& where) {
  if (!q.coeffs().allFinite()) return q;
  const double norm = q.norm();
  if (std::abs(norm - 1.0) > kMaxNormError) {
    throw DataError(fmt::format("{}: the quaternion's norm is {:.6g}, not 1 (to {})", where, norm, kMaxNormError));
  }
  return Eigen::Quaterniond(q.coeffs() / norm);
}

void require_later(TimeNs t_ns, TimeNs before_ns, const std::string& where) {
  if (t_ns > before_ns) return;
  throw DataError(fmt::format("{}: stamps must increase: this one is {} the one before", where,
                              t_ns == before_ns ? "a duplicate of" : "unsorted, earlier than"));
}

}  // namespace plumbline::core::pose_text
