#include "sim/streams.h"

#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "core/random.h"

namespace plumbline::sim {
namespace {

// A purpose is written as a literal where its stream is made, as in "imu0/gyro_white".
TEST(Streams, TheListIsComplete) {
  std::set<std::string> used;
  for (const auto& entry : std::filesystem::directory_iterator(PLUMBLINE_SOURCE_DIR "/sim/src")) {
    std::ifstream in(entry.path());
    const std::string text{std::istreambuf_iterator<char>(in), {}};
    for (std::size_t open = text.find('"'); open != std::string::npos; open = text.find('"', open + 1)) {
      const std::string word = text.substr(open + 1, text.find('"', open + 1) - open - 1);
      const bool plain = word.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789_/") == std::string::npos;
      const std::size_t slash = word.find('/');
      if (plain && slash != std::string::npos && slash > 0 && slash + 1 < word.size() && slash == word.rfind('/')) {
        used.insert(word);
      }
    }
  }
  EXPECT_EQ(used, std::set<std::string>(kStreams.begin(), kStreams.end()));
}

// Of n independent pairs the correlation has a standard deviation of 1/sqrt(n). The largest of some 400 correlations
// exceeds 4 of these by chance in 1 of 40 choices of the seed.
TEST(Streams, NoTwoAreCorrelated) {
  constexpr int kIndices = 5000;  // of four numbers
  std::vector<std::vector<double>> draws;
  for (const std::string_view purpose : kStreams) {
    const core::RandomStream stream({.seed = 1, .trial = 0}, purpose);
    std::vector<double>& d = draws.emplace_back();
    for (std::uint64_t i = 0; i < kIndices; ++i) {
      for (const double x : stream.normals(i)) d.push_back(x);
    }
  }
  const double n = 4.0 * kIndices;
  for (std::size_t a = 0; a < draws.size(); ++a) {
    for (std::size_t b = 0; b < a; ++b) {
      double product = 0.0;
      for (std::size_t i = 0; i < draws[a].size(); ++i) product += draws[a][i] * draws[b][i];
      EXPECT_LT(std::abs(product) / std::sqrt(n), 4.0) << kStreams[a] << ", " << kStreams[b];
    }
  }
}

}  // namespace
}  // namespace plumbline::sim
