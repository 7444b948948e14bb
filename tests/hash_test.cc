// Hashes are the published XXH3: names of results stay comparable across versions and machines.
#include "core/hash.h"

#include <fstream>
#include <string>

#include <gtest/gtest.h>

#include "core/error.h"

namespace plumbline::core {
namespace {

TEST(Hash, IsXxh3) {
  EXPECT_EQ(hash64(""), 0x2d06800538d394c2u);
  EXPECT_EQ(content_hash(""), "2d06800538d394c2");
  EXPECT_EQ(content_hash("a"), "e6c632b61e964e1f");
  EXPECT_NE(content_hash("ab"), content_hash("ba"));
}

TEST(Hash, OfAFileIsThatOfItsContent) {
  const auto file = std::filesystem::path(testing::TempDir()) / "plumbline_hash_test.bin";
  for (const std::size_t size : {std::size_t{0}, std::size_t{7}, std::size_t{1} << 20U, std::size_t{3'000'001}}) {
    std::string bytes(size, '\0');
    for (std::size_t i = 0; i < size; ++i) bytes[i] = static_cast<char>(i * i % 251);
    std::ofstream(file, std::ios::binary) << bytes;
    EXPECT_EQ(file_hash(file), content_hash(bytes)) << size;
  }
  std::filesystem::remove(file);
  EXPECT_THROW(file_hash(file), DataError);
  EXPECT_THROW(file_hash("/"), DataError);
}

}  // namespace
}  // namespace plumbline::core
