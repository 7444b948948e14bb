// bzip2 streams in memory (libbz2).
#pragma once

#include <cstdint>
#include <stdexcept>
#include <string>
#include <string_view>

namespace plumbline::core {

struct Bzip2Error : std::runtime_error {
  using std::runtime_error::runtime_error;
};

bool is_bzip2(std::string_view bytes);
std::string bzip2_compress(std::string_view bytes);

// One stream after the other, as the bzip2 program does. Throws Bzip2Error for a damaged or truncated stream, for
// bytes behind the last one, and where the result would exceed `limit` bytes.
std::string bzip2_decompress(std::string_view bytes, std::uint64_t limit);

}  // namespace plumbline::core
