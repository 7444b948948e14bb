#include "core/hash.h"

#include <cerrno>
#include <cstring>
#include <fstream>
#include <memory>
#include <vector>

#include <fmt/format.h>

#define XXH_INLINE_ALL
#include <xxhash.h>

#include "core/error.h"

namespace plumbline::core {

namespace {

std::string hex(std::uint64_t hash) { return fmt::format("{:016x}", hash); }

}  // namespace

std::uint64_t hash64(std::string_view bytes) { return XXH3_64bits(bytes.data(), bytes.size()); }

std::string content_hash(std::string_view bytes) { return hex(hash64(bytes)); }

std::string file_hash(const std::filesystem::path& file) {
  const std::string label = file.generic_string();
  std::error_code ignored;
  if (std::filesystem::is_directory(file, ignored)) throw DataError(label + ": is a directory");
  errno = 0;
  std::ifstream stream(file, std::ios::binary);
  if (!stream) throw DataError(label + ": cannot be opened: " + std::strerror(errno));

  const std::unique_ptr<XXH3_state_t, decltype(&XXH3_freeState)> state(XXH3_createState(), &XXH3_freeState);
  XXH3_64bits_reset(state.get());
  std::vector<char> chunk(std::size_t{1} << 20U);
  while (stream) {
    stream.read(chunk.data(), static_cast<std::streamsize>(chunk.size()));
    XXH3_64bits_update(state.get(), chunk.data(), static_cast<std::size_t>(stream.gcount()));
  }
  if (stream.bad()) throw DataError(label + ": cannot be read");
  return hex(XXH3_64bits_digest(state.get()));
}

}  // namespace plumbline::core
