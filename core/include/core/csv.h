// Comma-separated numbers, as EuRoC writes them: lines that start with # are comments, lines may end in CRLF.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace plumbline::core {

class CsvReader {
 public:
  // Throws DataError for a file that is missing or unreadable.
  CsvReader(const std::filesystem::path& file, std::size_t columns);

  // Goes to the next row; false at the end. Throws DataError `file:line: rule` for a row with another number of
  // columns.
  bool next();

  // Of the present row. Throws DataError for what is not a number, or not finite.
  std::int64_t integer(std::size_t column) const;
  double number(std::size_t column) const;

  // DataError at the present row.
  [[noreturn]] void fail(std::string_view rule) const;

 private:
  std::string name_;
  std::string text_;
  std::string_view rest_;
  int line_ = 0;
  std::vector<std::string_view> fields_;
  std::size_t columns_;
};

}  // namespace plumbline::core
