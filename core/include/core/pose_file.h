// Trajectories as TUM text files, one pose a line:   timestamp_s tx ty tz qx qy qz qw   (T_W_B, Hamilton, metres)
// Lines that start with # are comments, further columns are ignored, lines may end in CRLF.
// Stamps are read and written as decimal text, exactly: a double cannot hold the nanoseconds of a Unix time. Digits
// below a nanosecond are rounded, halves away from zero.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "core/lie.h"
#include "core/time.h"

namespace plumbline::core {

struct StampedPose {
  TimeNs t_ns = 0;
  Pose T_W_B;
};

struct PoseFileOptions {
  // Values that are NaN or infinite and stamps that do not increase are returned as they stand. An evaluator counts
  // such a file as a failed run; anything else that reads it should refuse it.
  bool allow_unusable = false;
};

// Throws DataError `file:line: rule`: too few columns, not a number, NaN or infinite, stamps unsorted or duplicate,
// a quaternion's norm off 1 by more than 1e-3 (a smaller deviation is normalised away), no poses, a missing or binary
// file.
std::vector<StampedPose> read_tum(const std::filesystem::path& path, const PoseFileOptions& options = {});

// The same from text; `name` stands for the file in messages.
std::vector<StampedPose> parse_tum(std::string_view text, const std::string& name, const PoseFileOptions& options = {});

// Whole or not at all (core/atomic_file.h); read_tum gives back the same stamps and positions to the last bit.
void write_tum(const std::filesystem::path& path, const std::vector<StampedPose>& poses);

}  // namespace plumbline::core
