// XXH3 with 64 bits (Y. Collet, xxhash.com) of bytes: names configurations, files and random streams. Not
// cryptographic.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

namespace plumbline::core {

std::uint64_t hash64(std::string_view bytes);

// The hash as 16 lower-case hexadecimal digits.
std::string content_hash(std::string_view bytes);

// The same of a file's content, of any size; DataError if it cannot be read.
std::string file_hash(const std::filesystem::path& file);

}  // namespace plumbline::core
