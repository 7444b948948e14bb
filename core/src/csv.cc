#include "core/csv.h"

#include <charconv>
#include <cmath>
#include <fstream>
#include <iterator>

#include <fmt/format.h>

#include "core/error.h"

namespace plumbline::core {

CsvReader::CsvReader(const std::filesystem::path& file, std::size_t columns, std::size_t optional_columns)
    : name_(file.generic_string()), columns_(columns), optional_columns_(optional_columns) {
  std::ifstream in(file, std::ios::binary);
  if (!in || std::filesystem::is_directory(file)) throw DataError(fmt::format("{}: cannot be read", name_));
  text_.assign(std::istreambuf_iterator<char>(in), {});
  if (in.bad()) throw DataError(fmt::format("{}: cannot be read", name_));
  rest_ = text_;
}

bool CsvReader::next() {
  while (!rest_.empty()) {
    ++line_;
    const std::size_t end = rest_.find('\n');
    std::string_view line = rest_.substr(0, end);
    rest_.remove_prefix(end == std::string_view::npos ? rest_.size() : end + 1);
    if (line.ends_with('\r')) line.remove_suffix(1);
    if (line.empty() || line.starts_with('#')) continue;
    fields_.clear();
    for (std::size_t start = 0; start <= line.size();) {
      const std::size_t comma = std::min(line.find(',', start), line.size());
      fields_.push_back(line.substr(start, comma - start));
      start = comma + 1;
    }
    if (fields_.size() != columns_ && fields_.size() != columns_ + optional_columns_) {
      fail(fmt::format("has {} columns, needs {}", fields_.size(), columns_ + optional_columns_));
    }
    return true;
  }
  return false;
}

std::int64_t CsvReader::integer(std::size_t column) const {
  const std::string_view field = fields_[column];
  std::int64_t value = 0;
  const auto [end, error] = std::from_chars(field.data(), field.data() + field.size(), value);
  if (error != std::errc() || end != field.data() + field.size()) fail(fmt::format("'{}' is not an integer", field));
  return value;
}

double CsvReader::number(std::size_t column) const {
  const std::string_view field = fields_[column];
  double value = 0.0;
  const auto [end, error] = std::from_chars(field.data(), field.data() + field.size(), value);
  if (error != std::errc() || end != field.data() + field.size()) fail(fmt::format("'{}' is not a number", field));
  if (!std::isfinite(value)) fail(fmt::format("'{}' is not finite", field));
  return value;
}

void CsvReader::fail(std::string_view rule) const { throw DataError(fmt::format("{}:{}: {}", name_, line_, rule)); }

}  // namespace plumbline::core
