// What the readers of pose files share: lines, words, and numbers with messages that say where.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include <Eigen/Geometry>

#include "core/time.h"

namespace plumbline::core::pose_text {

// The whole file. Throws DataError where it is missing, a folder, unreadable or binary.
std::string read_file(const std::filesystem::path& path);
void refuse_binary(std::string_view text, const std::string& name);

// The lines that are neither empty nor comments (#), one after the other.
class Lines {
 public:
  Lines(std::string_view text, std::string name) : rest_(text), name_(std::move(name)) {}

  std::optional<std::string_view> next();
  std::string where() const;  // "file:line" of the last one

 private:
  std::string_view rest_;
  std::string name_;
  int number_ = 0;
};

// The next word of `line`, which is cut off it; empty at the end.
std::string_view take_word(std::string_view& line);

// Decimal seconds as integer nanoseconds, exactly; digits below are rounded, halves away from zero.
TimeNs parse_seconds(std::string_view word, const std::string& where);

double parse_number(std::string_view word, const std::string& where, bool allow_non_finite = false);

// Normalised, or returned as it stands where it is not finite. DataError where its norm is off 1 by more than 1e-3.
Eigen::Quaterniond unit_quaternion(const Eigen::Quaterniond& q, const std::string& where);

// DataError unless the stamp comes after the one before.
void require_later(TimeNs t_ns, TimeNs before_ns, const std::string& where);

}  // namespace plumbline::core::pose_text
