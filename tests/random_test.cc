#include "core/random.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <string_view>
#include <utility>
#include <vector>

#include <Random123/philox.h>
#include <gtest/gtest.h>

#include "core/hash.h"

namespace plumbline::core {
namespace {

constexpr int kDraws = 20000;

std::vector<double> draws(TrialId id, std::string_view purpose, std::size_t component = 0, std::uint64_t first = 0) {
  const RandomStream stream(id, purpose);
  std::vector<double> x(kDraws);
  for (int i = 0; i < kDraws; ++i) x[i] = stream.normals(first + static_cast<std::uint64_t>(i))[component];
  return x;
}

// Of numbers with mean zero and the variance given.
double correlation(const std::vector<double>& a, const std::vector<double>& b, double variance = 1.0) {
  double sum = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += a[i] * b[i];
  return sum / (static_cast<double>(a.size()) * variance);
}

std::vector<double> centred_squares(std::vector<double> x) {
  for (double& value : x) value = value * value - 1.0;
  return x;
}

// Four sigma of the correlation of independent normals: false alarm 6e-5 each.
const double kLargestCorrelation = 4.0 / std::sqrt(kDraws);

double to_uniform(std::uint64_t bits) { return (static_cast<double>(bits >> 11U) + 0.5) / 9007199254740992.0; }

// kat_vectors of Random123.
TEST(Random, PhiloxKnownAnswers) {
  using Counter = r123::Philox4x64::ctr_type;
  using Key = r123::Philox4x64::key_type;
  const Counter zero = r123::Philox4x64()(Counter{}, Key{});
  EXPECT_EQ(zero, (Counter{{0x16554d9eca36314c, 0xdb20fe9d672d0fdc, 0xd7e772cee186176b, 0x7e68b68aec7ba23b}}));
  const Counter pi =
      r123::Philox4x64()(Counter{{0x243f6a8885a308d3, 0x13198a2e03707344, 0xa4093822299f31d0, 0x082efa98ec4e6c89}},
                         Key{{0x452821e638d01377, 0xbe5466cf34e90c6c}});
  EXPECT_EQ(pi, (Counter{{0xa528f45403e61d95, 0x38c72dbd566e9788, 0xa5a1610e72fd18b5, 0x57bd43b5e52b7fe6}}));
}

// counter = {index, sub, hash(purpose), 0}, key = {seed, trial}: each input in its own word, so that none can stand in
// for another.
TEST(Random, InputsAreCounterAndKey) {
  const RandomStream stream({.seed = 11, .trial = 22}, "imu0/gyro_white");
  const r123::Philox4x64::ctr_type counter = {{33, 44, hash64("imu0/gyro_white"), 0}};
  const r123::Philox4x64::key_type key = {{11, 22}};
  const auto bits = r123::Philox4x64()(counter, key);
  const auto u = stream.uniforms(33, 44);
  for (std::size_t i = 0; i < 4; ++i) EXPECT_EQ(u[i], to_uniform(bits[i])) << i;
  EXPECT_EQ(stream.uniform(33, 44), u[0]);
}

TEST(Random, NormalsAreBoxAndMuller) {
  const RandomStream stream({.seed = 3, .trial = 4}, "test");
  for (std::uint64_t i = 0; i < 100; ++i) {
    const auto u = stream.uniforms(i, 5);
    const auto n = stream.normals(i, 5);
    for (std::size_t k = 0; k < 4; k += 2) {
      EXPECT_NEAR(n[k] * n[k] + n[k + 1] * n[k + 1], -2.0 * std::log(u[k]), 1e-13);
      EXPECT_NEAR(std::remainder(std::atan2(n[k + 1], n[k]) / (2.0 * std::numbers::pi) - u[k + 1], 1.0), 0.0, 1e-14);
    }
    EXPECT_EQ(stream.normal(i, 5), n[0]);
    EXPECT_EQ(stream.normal2(i, 5), Eigen::Vector2d(n[0], n[1]));
    EXPECT_EQ(stream.normal3(i, 5), Eigen::Vector3d(n[0], n[1], n[2]));
  }
}

TEST(Random, SameInputsSameNumbersInAnyOrder) {
  const RandomStream a({.seed = 7, .trial = 1}, "world");
  const RandomStream b({.seed = 7, .trial = 1}, "world");
  std::array<std::array<double, 4>, 50> forward{};
  for (std::size_t i = 0; i < forward.size(); ++i) forward[i] = a.normals(i);
  for (std::size_t i = forward.size(); i-- > 0;) EXPECT_EQ(b.normals(i), forward[i]);
}

TEST(Random, SharedDrawsDoNotDependOnTheTrial) {
  const TrialId first{.seed = 7, .trial = 0};
  const TrialId second{.seed = 7, .trial = 1};
  EXPECT_EQ(RandomStream(first.shared(), "world").uniforms(5), RandomStream(second.shared(), "world").uniforms(5));
  EXPECT_NE(RandomStream(first.shared(), "world").uniforms(5), RandomStream(first, "world").uniforms(5));
  const TrialId other_seed{.seed = 8, .trial = 0};
  EXPECT_NE(RandomStream(first.shared(), "world").uniforms(5), RandomStream(other_seed.shared(), "world").uniforms(5));
}

TEST(Random, StreamsAreUncorrelated) {
  const TrialId id{.seed = 1, .trial = 1};
  const std::vector<double> a = draws(id, "imu0/gyro_white");
  EXPECT_LT(std::abs(correlation(a, draws(id, "imu0/accel_white"))), kLargestCorrelation);
  EXPECT_LT(std::abs(correlation(a, draws({.seed = 1, .trial = 2}, "imu0/gyro_white"))), kLargestCorrelation);
  EXPECT_LT(std::abs(correlation(a, draws({.seed = 2, .trial = 1}, "imu0/gyro_white"))), kLargestCorrelation);
  EXPECT_LT(std::abs(correlation(a, draws(id, "imu0/gyro_white", 0, 1))), kLargestCorrelation);  // the next sample
  EXPECT_NEAR(correlation(a, a), 1.0, 4.0 * std::sqrt(2.0 / kDraws));
}

// The four numbers of a sample; their squares too, since the halves of a Box-Muller pair share a radius.
TEST(Random, NumbersOfASampleAreIndependent) {
  const TrialId id{.seed = 1, .trial = 1};
  for (std::size_t i = 0; i < 4; ++i) {
    const std::vector<double> a = draws(id, "test", i);
    for (std::size_t j = 0; j < i; ++j) {
      const std::vector<double> b = draws(id, "test", j);
      EXPECT_LT(std::abs(correlation(a, b)), kLargestCorrelation) << i << j;
      EXPECT_LT(std::abs(correlation(centred_squares(a), centred_squares(b), 2.0)), kLargestCorrelation) << i << j;
    }
  }
}

// Each band is four sigma of the estimate: false alarm 6e-5.
TEST(Random, NormalsHaveTheMomentsOfNormals) {
  for (std::size_t component = 0; component < 4; ++component) {
    std::array<double, 5> moment{};
    for (const double x : draws({.seed = 5, .trial = 0}, "moments", component)) {
      for (int k = 1; k <= 4; ++k) moment[static_cast<std::size_t>(k)] += std::pow(x, k) / kDraws;
    }
    EXPECT_NEAR(moment[1], 0.0, 4.0 * std::sqrt(1.0 / kDraws));
    EXPECT_NEAR(moment[2], 1.0, 4.0 * std::sqrt(2.0 / kDraws));
    EXPECT_NEAR(moment[3], 0.0, 4.0 * std::sqrt(15.0 / kDraws));
    EXPECT_NEAR(moment[4], 3.0, 4.0 * std::sqrt(96.0 / kDraws));
  }
}

// Kolmogorov and Smirnov: sqrt(n) D stays below sqrt(ln(2/alpha)/2) = 2.225 but for alpha = 1e-4.
double kolmogorov(std::vector<double> probabilities) {
  std::ranges::sort(probabilities);
  const auto n = static_cast<double>(probabilities.size());
  double distance = 0.0;
  for (std::size_t i = 0; i < probabilities.size(); ++i) {
    distance = std::max({distance, std::abs(probabilities[i] - static_cast<double>(i) / n),
                         std::abs(probabilities[i] - static_cast<double>(i + 1) / n)});
  }
  return std::sqrt(n) * distance;
}

TEST(Random, DistributionFunctions) {
  for (std::size_t component = 0; component < 4; ++component) {
    std::vector<double> p = draws({.seed = 6, .trial = 0}, "distribution", component);
    for (double& x : p) x = 0.5 * std::erfc(-x / std::numbers::sqrt2);
    EXPECT_LT(kolmogorov(std::move(p)), 2.225) << component;

    const RandomStream stream({.seed = 6, .trial = 0}, "uniform");
    std::vector<double> u(kDraws);
    for (int i = 0; i < kDraws; ++i) u[i] = stream.uniforms(static_cast<std::uint64_t>(i))[component];
    EXPECT_GT(*std::ranges::min_element(u), 0.0);
    EXPECT_LT(*std::ranges::max_element(u), 1.0);
    EXPECT_LT(kolmogorov(std::move(u)), 2.225) << component;
  }
}

}  // namespace
}  // namespace plumbline::core
