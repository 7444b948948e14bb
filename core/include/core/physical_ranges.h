// The numbers that physical quantities accept, in configurations and in datasets: wide enough for any rig, and narrow
// enough that what is computed from them stays finite and ends.
#pragma once

#include "core/config.h"
#include "core/measurements.h"

namespace plumbline::core {

inline constexpr double kMostM = 1e4;      // lengths, positions in a scenario
inline constexpr double kMostPathM = 1e7;  // where a recording may lead: 3600 s at the largest speed
inline constexpr double kMostSpeedMS = 1e3;
inline constexpr double kMostAccelerationMS2 = 1e4;
inline constexpr double kMostGravityMS2 = 1e3;
inline constexpr double kMostRateRadS = 1e2;
inline constexpr double kMostAngleRad = 1e2;
inline constexpr double kMostFrequencyHz = 1e4;
inline constexpr double kMostPixels = 1e5;
inline constexpr double kMostTimeOffsetS = 10.0;  // td and readout
inline constexpr double kMostTimeOffsetSigmaS = 1.0;
inline constexpr double kMostNoiseDensity = 10.0;  // of either sensor, and of either bias walk
// What an inertial sensor reads, noise and defects included.
inline constexpr double kMostGyroReadingRadS = 1e3;
inline constexpr double kMostAccelReadingMS2 = 1e6;
// Of noises that something is weighed by: below, the weight's square overflows or drowns all others.
inline constexpr double kLeastSigma = 1e-12;

inline Range up_to(double most) { return between(0.0, most); }
inline Range within(double most) { return between(-most, most); }
inline Range positive_up_to(double most) { return {.lower = 0.0, .upper = most, .lower_open = true}; }
// A standard deviation that is not 0.
inline Range sigma_up_to(double most) { return between(kLeastSigma, most); }

// Whether a sensor could read it; what is not finite is no reading.
inline bool is_physical(const ImuSample& s) {
  return (s.gyro_rad_s.array().abs() <= kMostGyroReadingRadS).all() &&
         (s.accel_m_s2.array().abs() <= kMostAccelReadingMS2).all();
}

}  // namespace plumbline::core
