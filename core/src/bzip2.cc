#include "core/bzip2.h"

#include <algorithm>
#include <array>
#include <limits>

#include <bzlib.h>

namespace plumbline::core {
namespace {

constexpr std::size_t kChunk = std::size_t{1} << 20;

// libbz2 counts in 32 bits and takes its input as char*, though it only reads it.
void give(bz_stream& stream, std::string_view& rest) {
  const std::size_t n = std::min<std::size_t>(rest.size(), std::numeric_limits<int>::max());
  stream.next_in = const_cast<char*>(rest.data());
  stream.avail_in = static_cast<unsigned>(n);
  rest.remove_prefix(n);
}

struct Decompressor {
  bz_stream stream{};
  Decompressor() {
    if (BZ2_bzDecompressInit(&stream, 0, 0) != BZ_OK) throw std::runtime_error("libbz2 cannot start");
  }
  ~Decompressor() { BZ2_bzDecompressEnd(&stream); }
  Decompressor(const Decompressor&) = delete;
  Decompressor& operator=(const Decompressor&) = delete;
};

struct Compressor {
  bz_stream stream{};
  Compressor() {
    if (BZ2_bzCompressInit(&stream, 9, 0, 0) != BZ_OK) throw std::runtime_error("libbz2 cannot start");
  }
  ~Compressor() { BZ2_bzCompressEnd(&stream); }
  Compressor(const Compressor&) = delete;
  Compressor& operator=(const Compressor&) = delete;
};

}  // namespace

bool is_bzip2(std::string_view bytes) { return bytes.starts_with("BZh"); }

std::string bzip2_decompress(std::string_view bytes, std::uint64_t limit) {
  std::string text;
  std::string chunk(kChunk, '\0');
  while (!bytes.empty()) {
    if (!is_bzip2(bytes)) throw Bzip2Error("bytes that belong to no bzip2 stream");
    Decompressor d;
    std::string_view rest = bytes;
    int status = BZ_OK;
    while (status != BZ_STREAM_END) {
      if (d.stream.avail_in == 0) give(d.stream, rest);
      const bool starved = d.stream.avail_in == 0;
      d.stream.next_out = chunk.data();
      d.stream.avail_out = static_cast<unsigned>(chunk.size());
      status = BZ2_bzDecompress(&d.stream);
      if (status != BZ_OK && status != BZ_STREAM_END) throw Bzip2Error("a damaged bzip2 stream");
      const std::size_t produced = chunk.size() - d.stream.avail_out;
      if (status == BZ_OK && starved && produced == 0) throw Bzip2Error("a truncated bzip2 stream");
      if (text.size() + produced > limit) throw Bzip2Error("a bzip2 stream of implausible length");
      text.append(chunk, 0, produced);
    }
    bytes.remove_prefix(bytes.size() - rest.size() - d.stream.avail_in);
  }
  return text;
}

std::string bzip2_compress(std::string_view bytes) {
  Compressor c;
  std::string result;
  std::string chunk(kChunk, '\0');
  int status = BZ_OK;
  while (status != BZ_STREAM_END) {
    if (c.stream.avail_in == 0) give(c.stream, bytes);
    c.stream.next_out = chunk.data();
    c.stream.avail_out = static_cast<unsigned>(chunk.size());
    status = BZ2_bzCompress(&c.stream, bytes.empty() ? BZ_FINISH : BZ_RUN);
    if (status < 0) throw std::runtime_error("libbz2 cannot compress");
    result.append(chunk, 0, chunk.size() - c.stream.avail_out);
  }
  return result;
}

}  // namespace plumbline::core
