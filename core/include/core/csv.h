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
  CsvReader(const std::filesystem::path& file, std::size_t columns, std::size_t optional_columns = 0);

  // Goes to the next row; false at the end. Throws DataError `file:line: rule` for a row that has neither the columns
  // nor, all of them, the optional ones too.
  bool next();

  // Whether the present row has a text there.
  bool has(std::size_t column) const { return column < fields_.size() && !fields_[column].empty(); }

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
  std::size_t optional_columns_;
};

}  // namespace plumbline::core
