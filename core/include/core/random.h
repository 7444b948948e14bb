// Counter-based random numbers: one stream a (seed, trial, purpose), the sample's index is the counter. A draw depends
// on nothing but these, so neither threads nor shards nor other sensors change it.
//   Philox4x64-10: Salmon, Moraes, Dror, Shaw, "Parallel random numbers: as easy as 1, 2, 3", SC 2011 (Random123)
//   Normals by Box and Muller, 1958: sqrt(-2 ln u0) (cos 2 pi u1, sin 2 pi u1).
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <string_view>

#include <Eigen/Core>

namespace plumbline::core {

// What a trial draws from: trials of one experiment differ in `trial` only.
struct TrialId {
  std::uint64_t seed = 0;
  std::uint64_t trial = 0;

  // The draws that all trials of an experiment share: trajectory and world.
  TrialId shared() const { return {seed, std::numeric_limits<std::uint64_t>::max()}; }
};

class RandomStream {
 public:
  // The purpose names sensor and defect, as in "imu0/gyro_white".
  RandomStream(TrialId id, std::string_view purpose);

  // Four independent numbers of the sample (index, sub): uniform in (0, 1), or standard normal.
  std::array<double, 4> uniforms(std::uint64_t index, std::uint64_t sub = 0) const;
  std::array<double, 4> normals(std::uint64_t index, std::uint64_t sub = 0) const;

  double uniform(std::uint64_t index, std::uint64_t sub = 0) const { return uniforms(index, sub)[0]; }
  double normal(std::uint64_t index, std::uint64_t sub = 0) const { return normals(index, sub)[0]; }
  Eigen::Vector2d normal2(std::uint64_t index, std::uint64_t sub = 0) const;
  Eigen::Vector3d normal3(std::uint64_t index, std::uint64_t sub = 0) const;

 private:
  TrialId id_;
  std::uint64_t purpose_;
};

}  // namespace plumbline::core
