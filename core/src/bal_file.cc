#include "core/bal_file.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <iterator>
#include <limits>

#include <fmt/format.h>

#include "core/atomic_file.h"
#include "core/bzip2.h"
#include "core/error.h"

namespace plumbline::core {
namespace {

// The largest problem of BAL (13,682 cameras, 29 million observations) is 1.4 GB of text.
constexpr std::uint64_t kLargestText = std::uint64_t{8} << 30;
// bzip2 makes BAL's numbers 3 to 6 times shorter. What would grow a hundred times is no problem but a bomb.
constexpr std::uint64_t kLargestGrowth = 100;
constexpr std::uint64_t kSmallText = std::uint64_t{1} << 20;

constexpr bool is_space(char c) { return c == ' ' || (c >= '\t' && c <= '\r'); }

// A word as an error message may show it.
std::string shown(std::string_view word) {
  constexpr std::size_t kLongest = 32;
  std::string text;
  for (const char c : word.substr(0, kLongest)) {
    const bool printable = c > ' ' && c <= '~';
    text += printable ? std::string(1, c) : fmt::format("\\x{:02x}", static_cast<unsigned char>(c));
  }
  return text + (word.size() > kLongest ? "..." : "");
}

// The numbers of a text, one after the other.
class Numbers {
 public:
  Numbers(std::string_view text, const std::string& name) : text_(text), name_(name) {}

  // `what` names the number in messages.
  std::int64_t integer(const char* what) {
    const std::string_view word = next(what);
    std::int64_t value = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error != std::errc() || end != word.data() + word.size()) {
      fail(fmt::format("{} must be an integer, not '{}'", what, shown(word)));
    }
    return value;
  }

  std::int64_t count(const char* what) {
    const std::int64_t n = integer(what);
    if (n < 1) fail(fmt::format("{} must be at least 1, not {}", what, n));
    return n;
  }

  int index(const char* what, std::size_t size) {
    const std::int64_t i = integer(what);
    if (i < 0 || i >= static_cast<std::int64_t>(size)) {
      fail(fmt::format("{} must be from 0 to {}, not {}", what, size - 1, i));
    }
    return static_cast<int>(i);
  }

  double real(const char* what) {
    const std::string_view word = next(what);
    const std::string_view digits = word.substr(word.starts_with('+') ? 1 : 0);
    double value = 0.0;
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
    if (error == std::errc::result_out_of_range) {
      fail(fmt::format("{} is outside the range of a double: '{}'", what, shown(word)));
    }
    if (error != std::errc() || end != digits.data() + digits.size()) {
      fail(fmt::format("{} must be a number, not '{}'", what, shown(word)));
    }
    if (!std::isfinite(value)) fail(fmt::format("{} must be finite, not '{}'", what, shown(word)));
    return value;
  }

  void expect_end() {
    skip_space();
    if (at_ == text_.size()) return;
    const std::size_t from = at_;
    while (at_ < text_.size() && !is_space(text_[at_])) ++at_;
    fail(fmt::format("'{}' follows the last point", shown(text_.substr(from, at_ - from))));
  }

  [[noreturn]] void fail(const std::string& rule) const {
    const auto line = 1 + std::count(text_.begin(), text_.begin() + static_cast<std::ptrdiff_t>(at_), '\n');
    throw DataError(fmt::format("{}:{}: {}", name_, line, rule));
  }

 private:
  void skip_space() {
    while (at_ < text_.size() && is_space(text_[at_])) ++at_;
  }

  std::string_view next(const char* what) {
    skip_space();
    const std::size_t from = at_;
    while (at_ < text_.size() && !is_space(text_[at_])) ++at_;
    if (at_ == from) fail(fmt::format("the file ends where {} is expected", what));
    return text_.substr(from, at_ - from);
  }

  std::string_view text_;
  const std::string& name_;
  std::size_t at_ = 0;
};

struct Counts {
  std::size_t cameras = 0;
  std::size_t points = 0;
  std::size_t observations = 0;
};

Counts parse_counts(Numbers& numbers, std::size_t text_size) {
  const std::int64_t cameras = numbers.count("the number of cameras");
  const std::int64_t points = numbers.count("the number of points");
  const std::int64_t observations = numbers.count("the number of observations");
  // A number takes two bytes at least, with what separates it from the next.
  const auto room = static_cast<std::int64_t>(text_size / 2 + 1);
  const auto fits = [&](std::int64_t n, std::int64_t each, std::int64_t left) { return n <= left / each; };
  const bool possible = cameras <= std::numeric_limits<int>::max() && points <= std::numeric_limits<int>::max() &&
                        fits(cameras, 9, room) && fits(points, 3, room - 9 * cameras) &&
                        fits(observations, 4, room - 9 * cameras - 3 * points);
  if (!possible) {
    numbers.fail(fmt::format("{} cameras, {} points and {} observations cannot be in a file of {} bytes", cameras,
                             points, observations, text_size));
  }
  return {static_cast<std::size_t>(cameras), static_cast<std::size_t>(points), static_cast<std::size_t>(observations)};
}

Eigen::Vector3d parse_vector(Numbers& numbers, const char* what) {
  const double x = numbers.real(what);
  const double y = numbers.real(what);
  const double z = numbers.real(what);
  return {x, y, z};
}

std::string to_text(const BalProblem& problem) {
  fmt::memory_buffer out;
  const auto to = std::back_inserter(out);
  fmt::format_to(to, "{} {} {}\n", problem.cameras.size(), problem.points.size(), problem.observations.size());
  for (const auto& [camera, point, pixel] : problem.observations) {
    fmt::format_to(to, "{} {} {} {}\n", camera, point, pixel.x(), pixel.y());
  }
  for (const BalCamera& c : problem.cameras) {
    fmt::format_to(to, "{}\n{}\n{}\n{}\n{}\n{}\n{}\n{}\n{}\n", c.w.x(), c.w.y(), c.w.z(), c.t.x(), c.t.y(), c.t.z(),
                   c.intrinsics.f_px, c.intrinsics.k1, c.intrinsics.k2);
  }
  for (const Eigen::Vector3d& X : problem.points) fmt::format_to(to, "{}\n{}\n{}\n", X.x(), X.y(), X.z());
  return fmt::to_string(out);
}

}  // namespace

BalProblem parse_bal(std::string_view text, const std::string& name) {
  if (std::all_of(text.begin(), text.end(), is_space)) throw DataError(name + ":1: an empty file");
  Numbers numbers(text, name);
  const Counts counts = parse_counts(numbers, text.size());
  BalProblem problem;
  problem.observations.reserve(counts.observations);
  for (std::size_t i = 0; i < counts.observations; ++i) {
    BalObservation o;
    o.camera = numbers.index("the camera of an observation", counts.cameras);
    o.point = numbers.index("the point of an observation", counts.points);
    o.pixel.x() = numbers.real("u of an observation");
    o.pixel.y() = numbers.real("v of an observation");
    problem.observations.push_back(o);
  }
  problem.cameras.reserve(counts.cameras);
  for (std::size_t i = 0; i < counts.cameras; ++i) {
    BalCamera c;
    c.w = parse_vector(numbers, "a camera's rotation");
    c.t = parse_vector(numbers, "a camera's translation");
    c.intrinsics.f_px = numbers.real("a camera's focal length");
    c.intrinsics.k1 = numbers.real("a camera's k1");
    c.intrinsics.k2 = numbers.real("a camera's k2");
    problem.cameras.push_back(c);
  }
  problem.points.reserve(counts.points);
  for (std::size_t i = 0; i < counts.points; ++i) problem.points.push_back(parse_vector(numbers, "a point"));
  numbers.expect_end();
  return problem;
}

BalProblem read_bal(const std::filesystem::path& path) {
  const std::string name = path.generic_string();
  std::error_code none;
  if (!std::filesystem::exists(path, none)) throw DataError(name + ": no such file");
  if (std::filesystem::is_directory(path, none)) throw DataError(name + ": a folder, not a BAL problem");
  std::ifstream file(path, std::ios::binary);
  std::string text;
  if (std::filesystem::is_regular_file(path, none)) {
    text.resize(std::filesystem::file_size(path));
    file.read(text.data(), static_cast<std::streamsize>(text.size()));
  } else {
    text.assign(std::istreambuf_iterator<char>(file), {});
  }
  if (!file) throw DataError(name + ": cannot be read");
  if (is_bzip2(text)) {
    try {
      text = bzip2_decompress(text, std::min(kLargestText, kSmallText + kLargestGrowth * text.size()));
    } catch (const Bzip2Error& error) {
      throw DataError(fmt::format("{}:1: {}", name, error.what()));
    }
  }
  return parse_bal(text, name);
}

void write_bal(const std::filesystem::path& path, const BalProblem& problem) {
  const std::string text = to_text(problem);
  write_file_atomically(path, path.extension() == ".bz2" ? bzip2_compress(text) : text);
}

}  // namespace plumbline::core
