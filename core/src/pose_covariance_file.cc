#include "core/pose_covariance_file.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <iterator>

#include <fmt/format.h>

#include "core/error.h"

namespace plumbline::core {
namespace {

constexpr std::size_t kPoseColumns = 8;
constexpr std::size_t kCovarianceColumns = kPoseColumns + 21;
constexpr std::string_view kBlank = " \t\r\v\f";

std::vector<std::string_view> words(std::string_view line) {
  std::vector<std::string_view> result;
  for (std::size_t begin = line.find_first_not_of(kBlank); begin != std::string_view::npos;) {
    const std::size_t end = std::min(line.find_first_of(kBlank, begin), line.size());
    result.push_back(line.substr(begin, end - begin));
    begin = line.find_first_not_of(kBlank, end);
  }
  return result;
}

double parse_value(std::string_view word, const std::string& where) {
  double value = 0.0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error != std::errc() || end != word.data() + word.size()) {
    throw DataError(fmt::format("{}: '{}' is not a number", where, word));
  }
  if (!std::isfinite(value)) throw DataError(fmt::format("{}: '{}' is not finite", where, word));
  return value;
}

}  // namespace

std::vector<PoseCovariance> parse_tum_covariances(std::string_view text, const std::string& name) {
  std::vector<PoseCovariance> covariances;
  for (int number = 1; !text.empty(); ++number) {
    const std::string_view line = text.substr(0, text.find('\n'));
    text.remove_prefix(std::min(line.size() + 1, text.size()));
    const std::vector<std::string_view> columns = words(line);
    if (columns.empty() || columns.front().starts_with('#')) continue;
    if (covariances.empty() && columns.size() != kCovarianceColumns) return {};
    const std::string where = fmt::format("{}:{}", name, number);
    if (columns.size() != kCovarianceColumns) {
      throw DataError(fmt::format("{}: {} columns after lines of {}", where, columns.size(), kCovarianceColumns));
    }
    PoseCovariance& P = covariances.emplace_back();
    std::size_t column = kPoseColumns;
    for (int r = 0; r < 6; ++r) {
      for (int c = r; c < 6; ++c) P(r, c) = P(c, r) = parse_value(columns[column++], where);
    }
  }
  return covariances;
}

std::vector<PoseCovariance> read_tum_covariances(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  if (!file) throw DataError(path.string() + ": cannot be read");
  return parse_tum_covariances(text, path.string());
}

}  // namespace plumbline::core
