#include "core/random.h"

#include <cmath>
#include <numbers>

#include <Random123/philox.h>

#include "core/hash.h"

namespace plumbline::core {

RandomStream::RandomStream(TrialId id, std::string_view purpose) : id_(id), purpose_(hash64(purpose)) {}

std::array<double, 4> RandomStream::uniforms(std::uint64_t index, std::uint64_t sub) const {
  const r123::Philox4x64::ctr_type counter = {{index, sub, purpose_, 0}};
  const r123::Philox4x64::key_type key = {{id_.seed, id_.trial}};
  const auto bits = r123::Philox4x64()(counter, key);
  std::array<double, 4> u{};
  // The middle of one of 2^53 equal cells of (0, 1): never 0, so that its logarithm is finite.
  for (std::size_t i = 0; i < 4; ++i) u[i] = (static_cast<double>(bits[i] >> 11) + 0.5) * 0x1.0p-53;
  return u;
}

std::array<double, 4> RandomStream::normals(std::uint64_t index, std::uint64_t sub) const {
  const std::array<double, 4> u = uniforms(index, sub);
  std::array<double, 4> n{};
  for (std::size_t i = 0; i < 4; i += 2) {
    const double radius = std::sqrt(-2.0 * std::log(u[i]));
    const double angle = 2.0 * std::numbers::pi * u[i + 1];
    n[i] = radius * std::cos(angle);
    n[i + 1] = radius * std::sin(angle);
  }
  return n;
}

Eigen::Vector2d RandomStream::normal2(std::uint64_t index, std::uint64_t sub) const {
  const auto n = normals(index, sub);
  return {n[0], n[1]};
}

Eigen::Vector3d RandomStream::normal3(std::uint64_t index, std::uint64_t sub) const {
  const auto n = normals(index, sub);
  return {n[0], n[1], n[2]};
}

}  // namespace plumbline::core
